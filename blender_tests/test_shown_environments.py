# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted images of the world reach Cycles as an Environment Texture, and go again."""

import json

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from command_line import command
from node_groups import group, shown

from selenite import native
from selenite.cycles_check import render as cycles
from selenite.fit.fields.environment import view_of
from selenite.problems import BadInput
from selenite.scene_read.build import build
from selenite.scene_read.camera import read_camera
from selenite.write_back import environments

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def fitted(folder, seed=1, peak=70000.0):
    """A file as a fit leaves it, and its radiance; brighter than half floats hold."""
    values = np.random.default_rng(seed).uniform(0, 1, (8, 16, 3)).astype(np.float32)
    values[2, 5] = peak
    path = str(folder / f"fitted {seed}.exr")
    native.image().write_exr(path, values)
    return path, values


def value_of(item):
    if isinstance(item, (str, int, float, bool, type(None))):
        return item
    return item.name_full if isinstance(item, bpy.types.ID) else tuple(item)


def tree_of(tree):
    """Nodes with what they hold, and links."""
    links = {
        (i.from_socket.path_from_id(), i.to_socket.path_from_id(), i.is_muted) for i in tree.links
    }
    nodes = {
        node.name: (
            node.bl_idname,
            value_of(getattr(node, "image", None)),
            [value_of(getattr(item, "default_value", None)) for item in node.inputs],
        )
        for node in tree.nodes
    }
    return links, nodes


def all_of():
    """Trees and properties of worlds, node groups, and what images there are."""
    found = {
        w.name_full: (
            [name for name in w.keys() if name.startswith("selenite")],  # noqa: SIM118 - an ID
            tree_of(w.node_tree),
        )
        for w in bpy.data.worlds
    }
    groups = {g.name_full: tree_of(g) for g in bpy.data.node_groups}
    return found, groups, {image.name_full for image in bpy.data.images}


def background():
    return next(
        n for n in bpy.context.scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground"
    )


def read_world():
    values = made.read()
    assert not values.problems, values.problems
    return values.world


def show(path):
    return environments.show(bpy.context.scene, made.read(), path)


def test_one_colour_gives_way_to_the_image_and_comes_back(tmp_path):
    made.studio()
    background().inputs["Color"].default_value = (0.2, 0.3, 0.4, 1.0)
    background().inputs["Strength"].default_value = 2.5
    path, values = fitted(tmp_path)
    before = all_of()
    text = show(path)
    assert "World 'Studio' now takes its light from image 'Studio environment'" in text
    world = read_world()
    np.testing.assert_array_equal(world.image, values)
    assert (world.color, world.strength) == ((1, 1, 1), 2.5)
    np.testing.assert_array_equal(world.to_map, np.eye(3))
    image = bpy.data.images["Studio environment"]
    assert image.packed_file is not None and image.is_float
    environments.restore(bpy.context.scene)
    assert all_of() == before


def test_the_saved_file_holds_every_digit(tmp_path):
    made.studio()
    path, values = fitted(tmp_path)
    show(path)
    file = made.save(tmp_path / "scene.blend")
    (tmp_path / "fitted 1.exr").unlink()
    bpy.ops.wm.open_mainfile(filepath=file)
    np.testing.assert_array_equal(read_world().image, values)
    environments.restore(bpy.context.scene)
    assert read_world().image is None
    assert not bpy.data.images


def test_an_image_with_a_mapping_is_kept_in_the_tree_and_comes_back(tmp_path):
    made.studio()
    own = np.random.default_rng(5).random((4, 8, 3)).astype(np.float32)
    node = made.environment(bpy.context.scene.world, own, (0.0, 0.0, 0.5))
    path, values = fitted(tmp_path)
    before, turn = all_of(), read_world().to_map
    show(path)
    assert node.image.name == "sky"
    np.testing.assert_array_equal(read_world().image, values)
    np.testing.assert_array_equal(read_world().to_map, np.eye(3))
    environments.restore(bpy.context.scene)
    assert all_of() == before
    np.testing.assert_array_equal(read_world().to_map, turn)


def test_a_muted_link_comes_back_muted(tmp_path):
    made.studio()
    tree = bpy.context.scene.world.node_tree
    rgb = tree.nodes.new("ShaderNodeRGB")
    tree.links.new(rgb.outputs[0], background().inputs["Color"]).is_muted = True
    before = all_of()
    show(fitted(tmp_path)[0])
    environments.restore(bpy.context.scene)
    assert all_of() == before


def test_images_pile_up_and_go_one_by_one(tmp_path):
    made.studio()
    (first, one), (second, two) = fitted(tmp_path, 1), fitted(tmp_path, 2)
    before = all_of()
    show(first)
    show(second)
    np.testing.assert_array_equal(read_world().image, two)
    environments.restore(bpy.context.scene)
    np.testing.assert_array_equal(read_world().image, one)
    environments.restore(bpy.context.scene)
    assert all_of() == before
    environments.restore(bpy.context.scene)  # there is nothing to undo
    assert all_of() == before


def test_a_link_that_somebody_made_since_stays(tmp_path):
    made.studio()
    show(fitted(tmp_path)[0])
    tree = bpy.context.scene.world.node_tree
    rgb = tree.nodes.new("ShaderNodeRGB")
    tree.links.new(rgb.outputs[0], background().inputs["Color"])
    environments.restore(bpy.context.scene)
    assert background().inputs["Color"].links[0].from_node == rgb


def grouped(users=1):
    """The Background in a node group with so many users."""
    world = bpy.context.scene.world
    tree = world.node_tree
    inner, _, leave = group([], ["Shader"])
    node = inner.nodes.new("ShaderNodeBackground")
    inner.links.new(node.outputs[0], leave.inputs[0])
    for _ in range(users):
        outer = shown(tree, inner)
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(outer.outputs[0], output.inputs["Surface"])


def test_a_background_inside_a_group_of_its_own(tmp_path):
    made.studio()
    grouped()
    path, values = fitted(tmp_path)
    before = all_of()
    show(path)
    np.testing.assert_array_equal(read_world().image, values)
    environments.restore(bpy.context.scene)
    assert all_of() == before


def test_what_cannot_take_an_image_is_refused_and_nothing_changes(tmp_path):
    made.studio()
    path, _ = fitted(tmp_path)
    values = made.read()
    before = all_of()
    with pytest.raises(BadInput, match="it does not exist"):
        show(str(tmp_path / "gone.exr"))
    (tmp_path / "bad.exr").write_text("no picture")
    with pytest.raises(BadInput, match="cannot be read"):
        show(str(tmp_path / "bad.exr"))
    assert all_of() == before
    grouped(users=2)
    before = all_of()
    with pytest.raises(BadInput, match="which has 2 users.*make it single-user"):
        show(path)
    assert all_of() == before
    bpy.context.scene.world = None
    with pytest.raises(BadInput, match="it is gone"):
        environments.show(bpy.context.scene, values, path)


def test_showing_is_one_undo_step(tmp_path):
    """As in Apply: what the step takes back is all of it."""
    made.studio()
    path, values = fitted(tmp_path)
    before = all_of()
    undo_steps.prepare()
    show(path)
    bpy.ops.ed.undo_push(message="Apply")
    bpy.ops.ed.undo()
    assert all_of() == before
    bpy.ops.ed.redo()
    np.testing.assert_array_equal(read_world().image, values)
    environments.restore(bpy.context.scene)
    assert all_of() == before


def test_cycles_renders_what_selenite_renders(tmp_path):
    made.studio(base_color=(0.7, 0.5, 0.3), roughness=0.6)
    made.world(strength=0.8)
    path, _ = fitted(tmp_path, peak=12.0)
    show(path)
    values = made.read()
    film = native.core().render(build(values), "Camera", 32, 24, 512, seed=3)
    scene = bpy.context.scene
    camera = read_camera(scene.camera, "Camera", scene)
    found = cycles.estimate(
        scene, camera, (32, 24), 64, range(4), tmp_path / "c.exr", lambda _fraction: None, 1.0
    )
    error = np.abs(film.image.mean(axis=(0, 1)) / found.mean.mean(axis=(0, 1)) - 1)
    assert error.max() < 0.01, error


def result_folder(folder, values, rows=()):
    """As a fit leaves it."""
    folder.mkdir()
    native.image().write_exr(str(folder / "World_environment.exr"), values)
    row = {"value": [0.5, 0.5, 0.5], "files": ["World_environment.exr", "World_environment.png"]}
    parameters = {"World:environment": row, **dict(rows)}
    (folder / "result.json").write_text(json.dumps({"parameters": parameters}))
    return str(folder)


def test_render_of_a_result_is_that_of_the_saved_scene(tmp_path, capsys):
    made.studio(base_color=(0.7, 0.5, 0.3), roughness=0.6)
    path = made.save(tmp_path / "scene.blend")
    _, values = fitted(tmp_path, peak=12.0)
    folder = result_folder(
        tmp_path / "result", values, {"Body:roughness": {"value": 0.3}, "World:color": {"value": 1}}
    )
    words = ("--camera", "Camera", "--spp", "8", "--threads", "1")
    out = [tmp_path / "a.exr", tmp_path / "b.exr"]
    status, _, err = command(
        capsys, "render", path, *words, "--result", folder, "--out", str(out[0])
    )
    assert status == 0, err
    bpy.ops.wm.open_mainfile(filepath=path)
    show(str(tmp_path / "result" / "World_environment.exr"))
    saved = made.save(tmp_path / "saved.blend")
    status, _, err = command(
        capsys, "render", saved, *words, "--set", "Body:roughness=0.3", "--out", str(out[1])
    )
    assert status == 0, err
    one, two = (native.image().read(str(item))[0] for item in out)
    np.testing.assert_array_equal(one, two)
    status, _, err = command(
        capsys, "render", path, *words, "--result", str(tmp_path), "--out", str(out[0])
    )
    assert status == 2 and "give the folder of a fit that has ended" in err


def test_the_picture_next_to_the_image_shows_dim_rooms_with_bright_lamps():
    values = np.full((8, 16, 3), 0.1, np.float32)
    values[2, 3] = 1000
    view = view_of(values)
    assert view.shape == (128, 256, 3)
    assert view[0, 0, 0] == pytest.approx(0.5)
    assert view[2 * 16 + 8, 3 * 16 + 8, 0] == 1
