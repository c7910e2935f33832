# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of a reconstruction in a file of their own: axes, UVs, textures and materials of each
format."""

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
    assert mesh["materials"] == [{"name": mesh["name"], "texture": None}]


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
    ((of_name, texture),) = (one.values() for one in mesh["materials"])
    assert of_name == mesh["name"]
    if file.suffix == ".glb":
        assert texture == "packed:skin" and not [*tmp_path.glob("*/skin*")]
        (tmp_path / "skin.png").unlink()
        file.unlink()
    else:
        assert Path(texture) == tmp_path / "skin.png"
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


def written_with_two(file):
    """The box, whose second triangle has the material Other with other.png."""
    written_box(file)
    made.photo(file.parent / "other.png", (8, 8), 0.7)
    text = "" if file.suffix == ".gltf" else file.read_text()
    if file.suffix == ".ply":
        comment = "comment TextureFile other.png\nelement vertex"
        text = text.replace("element vertex", comment)
        text = text.replace("end_header", "property int texnumber\nend_header")
        *head, first, second, third = text.splitlines()
        file.write_text("\n".join([*head, f"{first} 0", f"{second} 1", f"{third} 0"]) + "\n")
    elif file.suffix == ".obj":
        (first, second, third) = [line for line in text.splitlines() if line.startswith("f ")]
        faces = "\n".join([first, third, "usemtl Other", second])
        file.write_text(text[: text.index("f ")] + faces + "\n")
        library = file.with_suffix(".mtl")
        library.write_text(library.read_text() + "newmtl Other\nmap_Kd other.png\n")
    elif file.suffix == ".x3d":
        points = " ".join(map(str, CORNERS.ravel()))
        uvs = " ".join(map(str, UVS.ravel()))
        shapes = ""
        for index, skin in ((TRIANGLES[::2], "skin"), (TRIANGLES[1:2], "other")):
            corners = " ".join(str(corner) for triangle in index for corner in triangle)
            shapes += (
                f'<Shape><Appearance DEF="{skin.title()}"><ImageTexture url="{skin}.png"/>'
                f'</Appearance><IndexedTriangleSet index="{corners}">'
                + ('<Coordinate USE="c"/>' if "c" in shapes else "")
                + ("" if "c" in shapes else f'<Coordinate DEF="c" point="{points}"/>')
                + f'<TextureCoordinate point="{uvs}"/></IndexedTriangleSet></Shape>'
            )
        file.write_text(f"<X3D><Scene>{shapes}</Scene></X3D>")
    else:
        y_up = CORNERS[:, [0, 2, 1]] * (1, 1, -1)
        skin, other = (file.parent / f"{name}.png" for name in ("skin", "other"))
        uvs = (0, 1) + UVS * (1, -1)
        made_gltf.write(file, y_up, TRIANGLES[::2], uvs, skin, other=(TRIANGLES[1:2], other))


@pytest.mark.parametrize("ending", ["obj", "ply", "x3d", "gltf"])
def test_each_texture_is_a_material_of_its_own(ending, tmp_path, capsys, request):
    reconstructed.written(tmp_path)
    file = tmp_path / f"box.{ending}"
    written_with_two(file)
    words = [str(file), "--cameras", str(tmp_path / "cameras.xml")]
    words += ["--photos", str(tmp_path / "photos")]
    report = imported(capsys, words, tmp_path / "out.blend")
    assert not [text for text in report["warnings"] if "texture" in text]
    whole = next(mesh for mesh in report["meshes"] if mesh["triangles"] == 3)
    textures = [Path(one["texture"]).name for one in whole["materials"]]
    assert sorted(textures) == ["other.png", "skin.png"]
    status, found, said = command(capsys, "check", str(tmp_path / "out.blend"))
    assert status == 0, said
    request.getfixturevalue("addon")
    reconstructed.opened(tmp_path / "out.blend")
    item = bpy.data.objects[whole["name"]]
    names = [slot.material.name for slot in item.material_slots]
    assert names == [one["name"] for one in whole["materials"]]
    assert "Other" in names or ending == "ply" and "other" in names
    for polygon in item.data.polygons:
        material = item.material_slots[polygon.material_index].material
        assert made.principled(material).inputs["Metallic"].default_value == 0
        (link,) = made.socket(material, "base_color").links
        # The second triangle alone has the corner 7.
        wanted = "other.png" if 7 in polygon.vertices else "skin.png"
        assert Path(link.from_node.image.filepath).name == wanted
    if ending == "gltf":
        part = bpy.data.objects["Part"]
        assert [slot.material.name for slot in part.material_slots] == ["Other"]
        assert len(bpy.data.materials) == 2


def test_a_texture_that_is_not_there_is_told(tmp_path, capsys):
    reconstructed.written(tmp_path)
    file = tmp_path / "box.obj"
    written_with_two(file)
    (tmp_path / "other.png").unlink()
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    report = imported(capsys, words, tmp_path / "out.blend")
    (mesh,) = report["meshes"]
    textures = {one["name"]: one["texture"] for one in mesh["materials"]}
    assert textures["Other"] is None and Path(textures["Skin"]).name == "skin.png"
    assert any(
        text.startswith("the texture 'other.png' of material 'Other' is not there")
        for text in report["warnings"]
    )


@pytest.mark.parametrize("named", ["skin.<UDIM>.png", "skin.1001.png"])
@pytest.mark.parametrize("ending", ["obj", "ply"])
def test_tiles_of_a_texture_are_materials(ending, named, tmp_path, capsys):
    """UVs of the second triangle lie in the second tile."""
    reconstructed.written(tmp_path)
    file = tmp_path / f"box.{ending}"
    for tile in ("1001", "1002"):
        made.photo(tmp_path / f"skin.{tile}.png", (8, 8), 0.2)
    corners, uvs = CORNERS[np.ravel(TRIANGLES)], UVS[np.ravel(TRIANGLES)]
    uvs[3:6, 0] += 1
    if ending == "ply":
        rows = np.hstack([corners, uvs])
        names = [f"float {name}" for name in "xyzst"]
        text = ply(rows, names, f"comment TextureFile {named}\n")
        *head, _, _, _ = text.splitlines()
        file.write_text("\n".join([*head, "3 0 1 2", "3 3 4 5", "3 6 7 8"]) + "\n")
    else:
        rows = ["mtllib box.mtl", "usemtl Skin"]
        rows += ["v " + " ".join(map(str, corner)) for corner in corners]
        rows += ["vt " + " ".join(map(str, uv)) for uv in uvs]
        rows += [f"f {n}/{n} {n + 1}/{n + 1} {n + 2}/{n + 2}" for n in (1, 4, 7)]
        file.write_text("\n".join(rows) + "\n")
        file.with_suffix(".mtl").write_text(f"newmtl Skin\nmap_Kd {named}\n")
    words = [str(file), "--cameras", str(tmp_path / "binary")]
    (mesh,) = imported(capsys, words, tmp_path / "out.blend")["meshes"]
    textures = [Path(one["texture"]).name for one in mesh["materials"]]
    assert textures == ["skin.1001.png", "skin.1002.png"]
