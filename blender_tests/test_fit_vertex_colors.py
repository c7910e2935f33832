# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit Board:vertex_colors`: from a photo to the colour attribute and its file."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.fit import fields
from selenite.fit.fields.vertex_colors import spread_over
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build
from selenite.scene_read.mesh_colors import shown_colors
from selenite.write_back import vertex_colors

pytestmark = pytest.mark.blender

NAME = "Board:vertex_colors"
SIDE = 5  # vertices


def board(domain="POINT", kind="FLOAT_COLOR", node="ShaderNodeVertexColor"):
    """A grid of vertices that fills the camera's picture, whose colours a node shows."""
    filled = made.material(base_color=(0.5, 0.5, 0.5), roughness=1.0)
    at = np.linspace(-1, 1, SIDE)
    places = [(x, y, 0) for y in at for x in at]
    faces = [
        (i, i + 1, i + SIDE + 1, i + SIDE) for i in range(SIDE * (SIDE - 1)) if i % SIDE < SIDE - 1
    ]
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata(places, [], faces)
    mesh.materials.append(filled)
    attribute = mesh.color_attributes.new("Col", kind, domain)
    attribute.data.foreach_set("color", [0.5, 0.5, 0.5, 0.25] * len(attribute.data))
    tree = filled.node_tree
    source = tree.nodes.new(node)
    if node == "ShaderNodeAttribute":
        source.attribute_name = "Col"
    else:
        source.layer_name = "Col"
    tree.links.new(source.outputs["Color"], made.socket(filled, "base_color"))
    made.world(strength=1.0, color=(0.8, 0.8, 0.8))
    camera = made.camera(distance=2.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 24
    return made.add("Board", mesh)


def requested(**values):
    """The field that is asked for so, or what is wrong."""
    problems = []
    found = fields.choose(
        made.read(), [UnknownRequest(*NAME.split(":"), **values)], [], FitSettings(), problems
    )
    return found[0] if found else str([item.line() for item in problems])


def truth(item):
    """(n, 3): smooth in x and y."""
    mesh = item.data
    where = mesh.color_attributes["Col"]
    places = np.array([vertex.co for vertex in mesh.vertices])
    if where.domain == "CORNER":
        places = places[[loop.vertex_index for loop in mesh.loops]]
    x, y = places[:, 0], places[:, 1]
    return np.stack([0.5 + 0.3 * x, 0.5 - 0.2 * y, 0.3 + 0.1 * x * y], axis=1).astype(np.float32)


def colors_of(item):
    data = item.data.color_attributes["Col"].data
    return np.array([tuple(one.color) for one in data], np.float32)


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_a_fit_finds_the_colours_and_the_saved_scene_has_them(domain, tmp_path, capsys):
    item = board(domain)
    path, wanted = made.save(tmp_path / "scene.blend"), truth(item)
    scene = build(made.read()).with_vertex_colors("Board", wanted)
    film = native.core().render(scene, "Camera", 24, 24, 1024, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    saved = tmp_path / "fitted.blend"
    status, report, _ = command(
        capsys, "fit", path, "--fit", NAME, "--photo", f"Camera={tmp_path / 'photo.exr'}",
        "--height", "24", "--threads", "1", "--out", str(tmp_path / "out"), "--iterations", "150",
        "--spp", "8", "--save", str(saved), "--check-in-cycles",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"][NAME]
    assert row["files"] == ["Board_vertex_colors.npy"]
    assert row["attribute"] == "Col"
    found = np.load(f"{report['folder']}/{row['files'][0]}")
    assert found.shape == wanted.shape
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.03  # 30 dB
    ours = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(ours["relative_bias"]) < 6 * ours["relative_bias_noise"] + 0.005
    # The open file is as it was; the saved one has the colours.
    assert np.allclose(colors_of(bpy.data.objects["Board"]), (0.5, 0.5, 0.5, 0.25))
    open_blend(str(saved))
    kept = colors_of(bpy.data.objects["Board"])
    assert np.allclose(kept[:, :3], found, atol=1e-6)
    assert np.allclose(kept[:, 3], 0.25)


@pytest.mark.parametrize(("kind", "most"), [("FLOAT_COLOR", 1e-6), ("BYTE_COLOR", 0.01)])
def test_colours_are_written_and_restored(kind, most, tmp_path):
    item = board("CORNER", kind, "ShaderNodeAttribute")
    before, wanted = colors_of(item), truth(item)
    np.save(tmp_path / "colors.npy", wanted)
    assert "'Col'" in vertex_colors.show(made.read(), "Board", str(tmp_path / "colors.npy"))
    assert np.abs(colors_of(item)[:, :3] - wanted).max() < most
    vertex_colors.show(made.read(), "Board", str(tmp_path / "colors.npy"))
    vertex_colors.restore("Board")
    assert np.array_equal(colors_of(item), before)
    assert [one.name for one in item.data.color_attributes] == ["Col"]
    vertex_colors.restore("Board")  # nothing is left to be undone


def graph_board(domain):
    """The same, with a gamma and a mixture between the colours and the material."""
    item = board(domain)
    tree = item.data.materials[0].node_tree
    source = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeVertexColor")
    gamma, inverse = tree.nodes.new("ShaderNodeGamma"), tree.nodes.new("ShaderNodeInvert")
    gamma.inputs["Gamma"].default_value = 1.5
    inverse.inputs["Fac"].default_value = 0.2
    tree.links.new(source.outputs["Color"], gamma.inputs["Color"])
    tree.links.new(gamma.outputs["Color"], inverse.inputs["Color"])
    made.link(item.data.materials[0], inverse.outputs["Color"])
    return item


@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
def test_colours_are_fitted_through_a_node_graph(domain, tmp_path, capsys):
    item = graph_board(domain)
    wanted = truth(item)
    scene = build(made.read()).with_vertex_colors("Board", wanted)
    film = native.core().render(scene, "Camera", 24, 24, 1024, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    status, report, _ = command(
        capsys, "fit", made.save(tmp_path / "scene.blend"), "--fit", NAME,
        "--photo", f"Camera={tmp_path / 'photo.exr'}", "--height", "24", "--threads", "1",
        "--out", str(tmp_path / "out"), "--iterations", "150", "--spp", "8",
    )  # fmt: skip
    assert status == 0, report
    found = np.load(f"{report['folder']}/Board_vertex_colors.npy")
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.03  # 30 dB


def test_the_derivative_through_a_graph_is_that_of_differences():
    scene = build((graph_board("POINT"), made.read())[1])
    photo = native.core().Photo("Camera", size=(24, 24))
    own = np.full((SIDE * SIDE, 3), 0.5, np.float32)

    def mean(values):
        evaluator = native.core().Evaluator(scene.with_vertex_colors("Board", values))
        return evaluator.picture(photo, 64, seed=5).image.mean(axis=(0, 1), dtype=float)

    _, slopes = native.core().Evaluator(scene).gradient(photo, "Board", "vertex_colors", 64, seed=5)
    for vertex, channel in ((0, 0), (7, 1), (12, 2), (18, 0)):
        ends = []
        for side in (-0.01, 0.01):
            moved = own.copy()
            moved[vertex, channel] += side
            ends.append(mean(moved)[channel])
        assert slopes[vertex, channel] == pytest.approx((ends[1] - ends[0]) / 0.02, rel=0.01)


def plain_board():
    """The same without colours: its material has one."""
    item = board()
    item.data.color_attributes.remove(item.data.color_attributes["Col"])
    tree = item.data.materials[0].node_tree
    tree.nodes.remove(next(n for n in tree.nodes if n.bl_idname == "ShaderNodeVertexColor"))
    return item


def test_a_new_attribute_takes_the_place_of_the_base_colour(tmp_path, capsys):
    item = board()
    wanted, path = truth(item), tmp_path / "photo.exr"
    scene = build(made.read()).with_vertex_colors("Board", wanted)
    film = native.core().render(scene, "Camera", 24, 24, 1024, seed=99)
    native.image().write_exr(str(path), film.image)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    plain_board()
    saved = tmp_path / "fitted.blend"
    status, report, _ = command(
        capsys, "fit", made.save(tmp_path / "scene.blend"), "--fit", NAME, "--grid", f"{NAME}=new",
        "--photo", f"Camera={path}", "--height", "24", "--threads", "1",
        "--out", str(tmp_path / "out"), "--iterations", "150", "--spp", "8", "--save", str(saved),
    )  # fmt: skip
    assert status == 0, report
    assert report["parameters"][NAME]["attribute"] == "Selenite"
    found = np.load(f"{report['folder']}/Board_vertex_colors.npy")
    assert np.sqrt(np.mean((found - wanted) ** 2)) < 0.03  # 30 dB
    open_blend(str(saved))
    mesh = bpy.data.objects["Board"].data
    kept = np.array([tuple(one.color) for one in mesh.color_attributes["Selenite"].data])
    assert np.allclose(kept[:, :3], found, atol=1e-6)
    values = made.read()
    name, shown, _ = shown_colors(values, values.objects[0], "")
    assert name == "Selenite" and np.allclose(shown, found, atol=1e-6)
    vertex_colors.restore("Board")
    assert not len(mesh.color_attributes)
    material = mesh.materials[0]
    assert not made.socket(material, "base_color").is_linked
    assert [node.bl_idname for node in material.node_tree.nodes].count("ShaderNodeVertexColor") == 0


def test_an_attribute_that_the_mesh_lacks_is_made(tmp_path):
    item = board()
    item.data.color_attributes.remove(item.data.color_attributes["Col"])
    new = requested(grid="new")
    assert (new.attribute, new.values.shape, new.materials) == ("Col", (SIDE * SIDE, 3), ())
    wanted = np.linspace(0, 1, 3 * SIDE * SIDE, dtype=np.float32).reshape(-1, 3)
    np.save(tmp_path / "colors.npy", wanted)
    assert "a new one" in vertex_colors.show(made.read(), "Board", str(tmp_path / "colors.npy"))
    assert np.allclose(colors_of(item)[:, :3], wanted, atol=1e-6)
    vertex_colors.restore("Board")
    assert not len(item.data.color_attributes)
    # One that it has is no new one, and a modifier makes other vertices.
    item.data.color_attributes.new("Col", "FLOAT_COLOR", "POINT")
    assert "that it has" in requested(grid="new")
    item.data.color_attributes.remove(item.data.color_attributes["Col"])
    item.modifiers.new("Subsurf", "SUBSURF")
    assert "modifiers" in requested(grid="new")


def test_a_node_without_a_name_shows_what_renders_by_default():
    """The attribute with the camera sign, not the active one, as in Cycles."""
    item = board()
    source = next(
        node for node in item.data.materials[0].node_tree.nodes
        if node.bl_idname == "ShaderNodeVertexColor"
    )  # fmt: skip
    source.layer_name = ""
    other = item.data.color_attributes.new("Other", "BYTE_COLOR", "CORNER")
    item.data.color_attributes.active_color = other
    assert requested().attribute == "Col"
    item.data.color_attributes.render_color_index = 1
    assert requested().attribute == "Other"


def test_what_cannot_be_fitted_is_named():
    item = board()
    subdivided = item.modifiers.new("Subsurf", "SUBSURF")
    assert "modifiers make other vertices" in requested()
    item.modifiers.remove(subdivided)
    assert requested(start=(0.5, 2.0, 0.5)).count("give 1 or 3 numbers in [0, 1]") == 1
    item.data.color_attributes.remove(item.data.color_attributes["Col"])
    assert "its mesh has no colour attribute 'Col'" in requested()
    tree = item.data.materials[0].node_tree
    tree.nodes.remove(next(n for n in tree.nodes if n.bl_idname == "ShaderNodeVertexColor"))
    assert "link a Color Attribute node" in requested()
    item.name = "Plank"
    assert "no object of the scene is called 'Board'" in requested()


def test_unseen_values_take_those_around_them():
    elements = np.array([0, 1, 2, 1, 2, 3, 2, 3, 4])
    values = np.zeros((6, 3), np.float32)
    values[:2] = (0.2, 0.4, 0.6), (0.4, 0.6, 0.8)
    known = np.array([True, True, False, False, False, False])
    found = spread_over(values, known, elements)
    assert np.allclose(found[2], (0.3, 0.5, 0.7))  # both at once, of two
    assert np.allclose(found[3], (0.4, 0.6, 0.8))
    assert np.allclose(found[4], (found[2] + found[3]) / 2)
    assert np.allclose(found[5], 0)  # nothing is next to it
