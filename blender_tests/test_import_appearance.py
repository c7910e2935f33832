# SPDX-License-Identifier: GPL-3.0-or-later
"""What the base colour of an imported OBJ or glTF is: where its picture lies, what is beside it,
its factors, as the formats say it; what is not read is named."""

import bpy
import made_gltf
import numpy as np
import pytest
import reconstructed
from command_line import command
from reconstructed import imported

from selenite import native

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

#: A square in the plane y = 0, one triangle of which is left out.
CORNERS = np.array([(-0.5, 0.0, -0.5), (0.5, 0.0, -0.5), (0.5, 0.0, 0.5)])
UVS = np.array([(0.1, 0.2), (0.9, 0.2), (0.9, 0.8)])
TRANSFORM = "KHR_texture_transform"


def written(folder, file, uvs=UVS, edit=lambda _: None):
    """A glTF with a picture of 4 x 4 known texels beside it, and cameras; words of an import."""
    reconstructed.written(folder)
    rng = np.random.default_rng(2)
    texels = rng.uniform(0.05, 0.95, (4, 4, 3)).astype(np.float32)
    native.image().write_png(str(folder / "skin.png"), texels, 16)
    path = folder / file
    made_gltf.write(path, CORNERS, [(0, 1, 2)], uvs, folder / "skin.png", edit=edit)
    return [str(path), "--cameras", str(folder / "cameras.xml")], texels


def opened(capsys, words, folder):
    """(report, mesh, Image Texture) of an import."""
    report = imported(capsys, words, folder / "out.blend")
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    mesh = next(item.data for item in bpy.data.objects if item.name == report["meshes"][0]["name"])
    nodes = mesh.materials[0].node_tree.nodes
    return report, mesh, next((n for n in nodes if n.bl_idname == "ShaderNodeTexImage"), None)


def uvs_of(mesh):
    found = np.empty(2 * len(mesh.loops), np.float32)
    mesh.uv_layers[0].data.foreach_get("uv", found)
    at = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", at)
    return found.reshape(-1, 2)[np.argsort(at)]


def base_texture(content):
    return content["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]


def test_a_texture_transform_of_gltf_moves_the_coordinates(tmp_path, capsys):
    """Scale, then rotation, then offset, with v downward, as the extension has it."""

    def edit(content):
        how = {"offset": [0.25, 0.5], "rotation": 0.6, "scale": [2.0, 0.5]}
        base_texture(content)["extensions"] = {TRANSFORM: how}
        content["extensionsUsed"] = [TRANSFORM]

    words, _ = written(tmp_path, "box.gltf", edit=edit)
    _, mesh, _ = opened(capsys, words, tmp_path)
    cos, sin = np.cos(0.6), np.sin(0.6)
    expected = UVS * (2.0, 0.5) @ np.array([[cos, sin], [-sin, cos]]).T + (0.25, 0.5)
    assert np.abs(uvs_of(mesh) - (expected * (1, -1) + (0, 1))).max() < 1e-5


def test_the_second_coordinates_of_gltf_count_where_it_says_so(tmp_path, capsys):
    def edit(content):
        base_texture(content)["texCoord"] = 1
        attributes = content["meshes"][0]["primitives"][0]["attributes"]
        attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"]
        attributes["TEXCOORD_0"] = 3
        content["accessors"].append(content["accessors"][1] | {"byteOffset": 0})
        # The first ones are three times the same corner of the second.
        content["accessors"][3]["bufferView"] = 4
        content["bufferViews"].append({"buffer": 0, "byteOffset": 0, "byteLength": 24})

    words, _ = written(tmp_path, "box.gltf", edit=lambda c: edit_views(c, edit))
    _, mesh, _ = opened(capsys, words, tmp_path)
    assert np.abs(uvs_of(mesh) - (UVS * (1, -1) + (0, 1))).max() < 1e-6


def edit_views(content, edit):
    while len(content["bufferViews"]) < 4:  # in place of the picture's, which lies beside
        content["bufferViews"].append({"buffer": 0, "byteOffset": 0, "byteLength": 4})
    edit(content)


@pytest.mark.parametrize(
    ("wraps", "kind"),
    [((33071, 33071), "EXTEND"), ((33648, 33648), "MIRROR"), ((10497, 33071), "REPEAT")],
)
def test_what_is_beside_a_picture_is_as_the_sampler_says(tmp_path, capsys, wraps, kind):
    """Where faces reach there. Blender 3.4 makes nodes of a mirror; two ways at once are named."""

    def edit(content):
        content["samplers"] = [{"wrapS": wraps[0], "wrapT": wraps[1]}]
        content["textures"][0]["sampler"] = 0

    words, _ = written(tmp_path, "box.gltf", 2 * UVS, edit)
    report, _, node = opened(capsys, words, tmp_path)
    named = any("wraps in one way across" in text for text in report["warnings"])
    if kind == "MIRROR" and bpy.app.version < (3, 5, 0):
        assert named
        return
    assert node.extension == kind and named == (kind == "REPEAT")


def test_a_picture_that_ends_nowhere_stays_plain(tmp_path, capsys):
    """Whatever the sampler says, as no face reaches beyond it."""

    def edit(content):
        content["samplers"] = [{"wrapS": 10497, "wrapT": 33071}]
        content["textures"][0]["sampler"] = 0

    words, _ = written(tmp_path, "box.gltf", edit=edit)
    report, _, node = opened(capsys, words, tmp_path)
    assert node.extension == "REPEAT" and not any("wraps" in text for text in report["warnings"])


@pytest.mark.parametrize("has_picture", [True, False])
def test_a_factor_is_part_of_the_base_colour(tmp_path, capsys, has_picture):
    """In the picture, so that the image is the base colour and can be fitted."""
    factor = (0.5, 0.25, 0.8)

    def edit(content):
        shown = content["materials"][0]["pbrMetallicRoughness"]
        shown["baseColorFactor"] = [*factor, 1.0]
        if not has_picture:
            del shown["baseColorTexture"]

    words, texels = written(tmp_path, "box.gltf", edit=edit)
    _, mesh, node = opened(capsys, words, tmp_path)
    nodes = mesh.materials[0].node_tree.nodes
    socket = next(n for n in nodes if "Base Color" in n.inputs).inputs["Base Color"]
    if not has_picture:
        assert tuple(socket.default_value)[:3] == pytest.approx(factor, abs=1e-6)
        return
    assert socket.links[0].from_node == node
    (tmp_path / "packed.png").write_bytes(node.image.packed_file.data)
    shown = native.image().read(str(tmp_path / "packed.png"))[0]
    assert np.abs(shown - texels * factor).max() < 1e-4


def test_what_is_not_read_of_a_gltf_is_named(tmp_path, capsys):
    def edit(content):
        content["materials"][0] |= {"alphaMode": "BLEND", "normalTexture": {"index": 0}}
        content["images"].append({"uri": "nowhere.png"})

    words, _ = written(tmp_path, "box.gltf", edit=edit)
    report, _, _ = opened(capsys, words, tmp_path)
    said = " ".join(report["warnings"])
    assert "its base colour alone is read; not read: Alpha, Normal" in said
    assert "the texture 'nowhere.png' is not there" in said


def test_a_gltf_of_metal_and_factors_above_1_are_named(tmp_path, capsys):
    def edit(content):
        shown = content["materials"][0].setdefault("pbrMetallicRoughness", {})
        shown |= {"baseColorFactor": [1.5, 0.5, 0.5, 1], "metallicFactor": 1}

    words, _ = written(tmp_path, "box.gltf", edit=edit)
    said = " ".join(opened(capsys, words, tmp_path)[0]["warnings"])
    assert "factors of its base colour above 1 are cut off" in said
    assert "its base colour alone is read; not read: Metallic" in said


def written_obj(folder, library="newmtl Skin\nKd 1 1 1\nmap_Kd skin.png\n", obj="", name="box.mtl"):
    reconstructed.written(folder)
    texels = np.random.default_rng(2).uniform(0.05, 0.95, (4, 4, 3)).astype(np.float32)
    native.image().write_png(str(folder / "skin.png"), texels, 16)
    if library is not None:
        (folder / "box.mtl").write_bytes(
            library if isinstance(library, bytes) else library.encode()
        )
    rows = [f"mtllib {name}", "usemtl Skin"]
    rows += ["v " + " ".join(map(str, corner)) for corner in CORNERS]
    rows += ["vt " + " ".join(map(str, uv)) for uv in UVS]
    text = obj or "\n".join([*rows, "f 1/1 2/2 3/3"]) + "\n"
    (folder / "box.obj").write_bytes(text if isinstance(text, bytes) else text.encode())
    return [str(folder / "box.obj"), "--cameras", str(folder / "cameras.xml")]


NAMES = {
    "as it is": "skin.png",
    "of windows": ".\\skin.png",
    "in another case": "Skin.PNG",
    "in quotes": '"skin.png"',
    "of another computer": "C:\\Users\\me\\scan\\skin.png",
    "after options": "-s 2 3 1 -o 0.25 0.5 0 skin.png",
}


@pytest.mark.parametrize("how", NAMES)
def test_the_picture_of_an_obj_is_found_however_it_is_named(tmp_path, capsys, how):
    words = written_obj(tmp_path, f"newmtl Skin\n\tmap_Kd {NAMES[how]}\n")
    report, mesh, node = opened(capsys, words, tmp_path)
    assert report["meshes"][0]["materials"][0]["texture"] == str(tmp_path / "skin.png")
    assert node is not None
    expected = UVS * (2, 3) + (0.25, 0.5) if how == "after options" else UVS
    assert np.abs(uvs_of(mesh) - expected).max() < 1e-6
    replaced = any("'skin.png' takes its place" in text for text in report["warnings"])
    assert replaced == (how == "in another case")


@pytest.mark.parametrize("how", ["mark", "old Macintosh", "Windows"])
def test_an_obj_is_read_however_its_lines_end(tmp_path, capsys, how):
    words = written_obj(tmp_path)
    for file in (tmp_path / "box.obj", tmp_path / "box.mtl"):
        ends = {"old Macintosh": b"\r", "Windows": b"\r\n"}.get(how, b"\n")
        mark = b"\xef\xbb\xbf" if how == "mark" else b""
        file.write_bytes(mark + file.read_bytes().replace(b"\n", ends))
    report, mesh, node = opened(capsys, words, tmp_path)
    assert node is not None and np.abs(uvs_of(mesh) - UVS).max() < 1e-6
    assert any("byte order mark" in text for text in report["warnings"]) == (how == "mark")


def test_a_library_that_is_not_there_is_named(tmp_path, capsys):
    words = written_obj(tmp_path, library=None)
    report, _, node = opened(capsys, words, tmp_path)
    said = " ".join(report["warnings"])
    assert node is None and "the library of materials 'box.mtl' is not there" in said
    assert "no library has the materials 'Skin': their faces are white" in said


def test_the_colour_of_an_obj_is_its_base_colour(tmp_path, capsys):
    words = written_obj(tmp_path, "newmtl Skin\nKd 0.5 0.25 0.8\nd 0.5\n")
    report, mesh, _ = opened(capsys, words, tmp_path)
    nodes = mesh.materials[0].node_tree.nodes
    socket = next(n for n in nodes if "Base Color" in n.inputs).inputs["Base Color"]
    assert tuple(socket.default_value)[:3] == pytest.approx((0.5, 0.25, 0.8), abs=1e-6)
    assert "material 'Skin': its transparency (d 0.5) is not read" in report["warnings"]


UNREAD = {
    "Kd xyz 0.2 0.7 0.3": "its Kd xyz 0.2 0.7 0.3 is not read: its faces are white",
    "Kd spectral skin.rfl 1": "its Kd spectral skin.rfl 1 is not read: its faces are white",
    "Kd 0.5 nan 0.5": "its Kd 0.5 nan 0.5 is not read: its faces are white",
    "Kd 2 0.5 0.5": "its Kd 2 0.5 0.5 is not read: its faces are white",
    "map_Ka skin.png": "it has neither Kd nor map_Kd: its faces are white",
    "Kd 0.5 0.5 0.5\nKe 1 0.5 0.2": "its Ke 1 0.5 0.2 is not read",
    "Kd 0.5 0.5 0.5\nPm 1": "its Pm 1 is not read",
    "Kd 0.5 0.5 0.5\nKe 0 0 0\nPm 0.0": "",
    "map_Kd skin.png\nKd xyz 1 1 1": "",
}


@pytest.mark.parametrize("library", UNREAD)
def test_what_is_not_read_of_an_obj_is_named(library, tmp_path, capsys):
    report, _, _ = opened(capsys, written_obj(tmp_path, f"newmtl Skin\n{library}\n"), tmp_path)
    said = [text for text in report["warnings"] if text.startswith("material 'Skin'")]
    assert said == [f"material 'Skin': {text}" for text in [UNREAD[library]] if text]


def test_a_normal_that_is_no_number_is_that_of_the_face(tmp_path, capsys):
    rows = ["v " + " ".join(map(str, corner)) for corner in CORNERS]
    rows += ["vn nan nan nan", "vn 0 1 0", "f 1//1 2//1 3//1", "f 3//2 2//2 1//2"]
    report, mesh, _ = opened(capsys, written_obj(tmp_path, obj="\n".join(rows)), tmp_path)
    assert any("1 of its normals are no numbers" in text for text in report["warnings"])
    assert all(np.isfinite(one.normal[:]).all() for one in mesh.polygons)


BROKEN = {
    "comma": ("v -0,5 0 1", "line 2", "'-0,5' has a decimal comma"),
    "no number": ("v 1.#QNAN 0 1", "line 2", "'1.#QNAN' is no number"),
    "infinite": ("v inf 0 1", "line 2", "'inf' is no finite number"),
    "too large": ("v 1e40 0 1", "line 2", "'1e40' is no finite number"),
    "short": ("v 1 2", "line 2", "a vertex has 2 numbers; it needs 3"),
    "coordinate": ("vt nan 0", "line 2", "'nan' is no finite number"),
    "beyond": ("f 1 2 9", "line 2", "a face names vertex 1, and 0 are there"),
    "zero": ("f 0 1 2", "line 2", "a face names vertex 0"),
    "corners": ("f 1 2", "line 2", "a face has 2 corners; it needs 3"),
    "word": ("f 1 b 3", "line 2", "'b' is no corner of a face"),
    "back": ("f -1 -2 -3", "line 2", "a face names vertex -1, and 0 are there"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_broken_obj_is_refused_by_its_line(fault, tmp_path, capsys):
    line, place, cause = BROKEN[fault]
    words = written_obj(tmp_path, obj=f"o Box\n{line}\n")
    status, report, _ = command(capsys, "import", *words, "--save", str(tmp_path / "out.blend"))
    (problem,) = report["problems"]
    assert status == 2 and f"{place}: {cause}" in problem["cause"]
    assert not (tmp_path / "out.blend").exists()
