# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of a reconstruction in a file of their own: axes, UVs and textures of each format."""

from pathlib import Path

import bpy
import made_gltf
import made_scenes as made
import numpy as np
import pytest
import reconstructed
from command_line import command
from reconstructed import imported

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def test_a_gltf_that_is_none_is_told_in_a_line(tmp_path, capsys):
    """Without the traceback of the importer."""
    reconstructed.written(tmp_path)
    (tmp_path / "box.glb").write_bytes(b"glTF" + bytes(60))
    words = [str(tmp_path / "box.glb"), "--cameras", str(tmp_path / "cameras.xml")]
    words += ["--save", str(tmp_path / "out.blend")]
    status, report, _ = command(capsys, "import", *words)
    (problem,) = report["problems"]
    assert status == 2 and "box.glb" in problem["object"] and "not imported" in problem["cause"]
    assert len(problem["cause"]) < 400 and "Traceback" not in problem["cause"]
    assert not (tmp_path / "out.blend").exists()


#: Of a box that is wider along y than along z, some triangles with all corners; z points upward.
CORNERS = np.array([(x, y, z) for x in (-0.05, 0.05) for y in (0.35, 0.65) for z in (-0.1, 0.1)])
TRIANGLES = [(0, 1, 3), (4, 6, 7), (0, 2, 5)]
UVS = CORNERS[:, 1:] + 0.3


def ply(values, names, comment=""):
    """The box in text. values: numbers of each vertex, whose properties have the `names`."""
    head = f"ply\nformat ascii 1.0\n{comment}element vertex {len(values)}\n"
    head += "".join(f"property {name}\n" for name in names)
    head += f"element face {len(TRIANGLES)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(str, row)) for row in values]
    rows += [f"3 {a} {b} {c}" for a, b, c in TRIANGLES]
    return head + "\n".join(rows) + "\n"


def written_box(file):
    """The box with the texture skin.png beside it."""
    made.photo(file.parent / "skin.png", (8, 8), 0.2)
    if file.suffix == ".ply":
        names = [f"float {name}" for name in "xyzst"]
        file.write_text(ply(np.hstack([CORNERS, UVS]), names, "comment TextureFile skin.png\n"))
    elif file.suffix == ".obj":
        rows = ["mtllib box.mtl", "usemtl Skin"]
        rows += ["v " + " ".join(map(str, corner)) for corner in CORNERS]
        rows += ["vt " + " ".join(map(str, uv)) for uv in UVS]
        rows += ["f " + " ".join(f"{n + 1}/{n + 1}" for n in corners) for corners in TRIANGLES]
        file.write_text("\n".join(rows) + "\n")
        file.with_suffix(".mtl").write_text("newmtl Skin\nKd 1 1 1\nmap_Kd skin.png\n")
    else:
        y_up = CORNERS[:, [0, 2, 1]] * (1, 1, -1)
        picture = file.parent / "skin.png"
        is_lit = "unlit" not in file.stem
        made_gltf.write(file, y_up, TRIANGLES, (0, 1) + UVS * (1, -1), picture, is_lit)


def test_a_gltf_in_the_axes_of_the_cameras_stays_in_them(tmp_path, capsys, request):
    """As programs write it that do not turn z upward to y."""
    truth, _ = reconstructed.written(tmp_path)
    file = tmp_path / "pebble.glb"
    mesh, skin = truth.mesh, made.photo(tmp_path / "skin.png", (8, 8), 0.2)
    made_gltf.write(file, mesh.positions, mesh.triangles, mesh.uvs, skin)
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert any("pebble.glb' is not turned" in text for text in report["warnings"])
    request.getfixturevalue("addon")
    reconstructed.opened(tmp_path / "out.blend")
    item = next(x for x in bpy.data.objects if x.type == "MESH" and not x.hide_render)
    apart = reconstructed.vertices_of(item)[:, None] - truth.mesh.positions[None]
    assert np.linalg.norm(apart, axis=2).min(axis=1).max() < 1e-6


def test_a_picture_of_light_is_no_base_colour(tmp_path, capsys):
    reconstructed.written(tmp_path)
    file, skin = tmp_path / "box.glb", made.photo(tmp_path / "skin.png", (8, 8), 0.2)
    made_gltf.write(file, CORNERS, TRIANGLES, UVS, skin, glows=True)
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    (mesh,) = imported(capsys, words, tmp_path / "out.blend")["meshes"]
    assert mesh["texture"] is None


@pytest.mark.parametrize("name", ["box.obj", "box.ply", "box.gltf", "box.glb", "unlit.glb"])
def test_meshes_have_the_axes_of_the_file_and_its_texture(name, tmp_path, capsys, request):
    """Those of glTF, whose y points upward, are turned so that z does. A picture inside of a file
    gets into the scene's, which is ready to fit without it."""
    _, words = reconstructed.written(tmp_path)
    file = tmp_path / name
    written_box(file)
    words = [str(file), "--cameras", str(tmp_path / "cameras.xml")]
    report = imported(
        capsys, [*words, "--photos", str(tmp_path / "photos")], tmp_path / "out.blend"
    )
    (mesh,) = report["meshes"]
    if file.suffix == ".glb":
        assert mesh["texture"] == "packed:skin" and not [*tmp_path.glob("*/skin*")]
        (tmp_path / "skin.png").unlink()
        file.unlink()
    else:
        assert Path(mesh["texture"]) == tmp_path / "skin.png"
    assert not [text for text in report["warnings"] if "texture" in text]
    status, found, said = command(capsys, "check", str(tmp_path / "out.blend"))
    assert status == 0, said
    request.getfixturevalue("addon")
    reconstructed.opened(tmp_path / "out.blend")
    item = next(one for one in bpy.data.objects if one.type == "MESH")
    places = reconstructed.vertices_of(item)
    assert np.abs(places - CORNERS).max() < 1e-6
    uvs = np.empty(len(item.data.loops) * 2, np.float32)
    item.data.uv_layers[0].data.foreach_get("uv", uvs)
    assert np.abs(uvs.reshape(-1, 2) - UVS[np.ravel(TRIANGLES)]).max() < 1e-6
    material = item.material_slots[0].material
    assert made.principled(material).inputs["Metallic"].default_value == 0
    (link,) = made.socket(material, "base_color").links
    image = link.from_node.image
    assert tuple(image.size) == (8, 8) and image.colorspace_settings.name == "sRGB"
    assert np.allclose(image.pixels[:3], 0.485, atol=0.01)  # sRGB of 0.2


@pytest.mark.parametrize("ending", ["ply", "obj"])
def test_vertex_colours_are_kept_beside_a_white_base_colour(ending, tmp_path, capsys, request):
    """Code values of sRGB in the file, linear light in the scene."""
    reconstructed.written(tmp_path)
    file = tmp_path / f"box.{ending}"
    codes = [(255, 188, 0)] * 7 + [(0, 255, 255)]
    if ending == "ply":
        names = [f"float {name}" for name in "xyz"]
        names += [f"uchar {name}" for name in ("red", "green", "blue")]
        file.write_text(ply(np.hstack([CORNERS, codes]), names))
    else:
        rows = [f"v {x} {y} {z} {r / 255} {g / 255} {b / 255}"
                for (x, y, z), (r, g, b) in zip(CORNERS, codes, strict=True)]  # fmt: skip
        rows += ["f " + " ".join(str(n + 1) for n in corners) for corners in TRIANGLES]
        file.write_text("\n".join(rows) + "\n")
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert sum("has vertex colours" in text for text in report["warnings"]) == 1
    request.getfixturevalue("addon")
    reconstructed.opened(tmp_path / "out.blend")
    item = next(one for one in bpy.data.objects if one.type == "MESH" and not one.hide_render)
    material = item.material_slots[0].material
    assert not made.socket(material, "base_color").is_linked
    assert tuple(made.socket(material, "base_color").default_value) == (1, 1, 1, 1)
    colors = np.empty(4 * 8, np.float32)
    item.data.color_attributes["Color"].data.foreach_get("color", colors)
    expected = [(1, 0.503, 0, 1)] * 7 + [(0, 1, 1, 1)]
    assert np.abs(colors.reshape(-1, 4) - expected).max() < 1e-3


def test_a_second_texture_is_told(tmp_path, capsys):
    reconstructed.written(tmp_path)
    file = tmp_path / "box.obj"
    written_box(file)
    made.photo(tmp_path / "other.png", (8, 8), 0.7)
    file.write_text(file.read_text() + "usemtl Other\nf 1/1 2/2 6/6\n")
    materials = file.with_suffix(".mtl")
    materials.write_text(materials.read_text() + "newmtl Other\nmap_Kd other.png\n")
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    report = imported(capsys, words, tmp_path / "out.blend")
    (mesh,) = report["meshes"]
    assert Path(mesh["texture"]).name == "skin.png" and mesh["triangles"] == 4
    warning = "mesh 'box': of its textures only the first is used; export it with one"
    assert warning in report["warnings"]
