# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted images reach Cycles as Image Texture nodes."""

from contextlib import contextmanager

import bpy
import made_images
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from made_scenes import link

from selenite import native
from selenite.cycles_check import render as cycles
from selenite.problems import BadInput
from selenite.write_back import images

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

SIZE = (7, 5)  # odd, and as small as Blender renders


def fitted(folder, kind="png", seed=1):
    """A file as a fit leaves it, and its linear colours, row 0 at the top."""
    colours = np.random.default_rng(seed).uniform(0, 1, (*SIZE[::-1], 3)).astype(np.float32)
    path = str(folder / f"fitted {seed}.{kind}")
    if kind == "png":
        native.image().write_png(path, colours, bit_depth=16)
    else:
        native.image().write_exr(path, colours)
    return path, colours


def body():
    """A triangle of the material 'Body' with a constant colour, and a camera."""
    material = made.material(base_color=(0.25, 0.5, 0.75))
    made.triangle(material=material)
    made.camera()
    return material


def add(tree, kind, **settings):
    """A new node."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def textured(folder):
    """The material with an image, placed by a Mapping node; and the image's node."""
    material = body()
    tree = material.node_tree
    old = made_images.image(folder, "file8", alpha=False)
    node = add(tree, "TexImage", image=old, extension="EXTEND", interpolation="Closest")
    mapping = add(tree, "Mapping")
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    tree.links.new(add(tree, "TexCoord").outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    link(material, node.outputs["Color"])
    return material, node


def group(outer, output="Color"):
    """A node group in a tree: its node, and the two ends of the tree inside."""
    tree = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    if hasattr(tree, "interface"):
        tree.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
        tree.interface.new_socket("Out", in_out="OUTPUT", socket_type=f"NodeSocket{output}")
    else:
        tree.inputs.new("NodeSocketColor", "In")
        tree.outputs.new(f"NodeSocket{output}", "Out")
    node = add(outer, "Group", node_tree=tree)
    return node, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")


def picture_group(outer, folder):
    """A node group that gives an image: its node, and that of the image."""
    node, _, leave = group(outer)
    inner = add(leave.id_data, "TexImage", image=made_images.image(folder, alpha=False))
    leave.id_data.links.new(inner.outputs["Color"], leave.inputs[0])
    return node, inner


def value_of(item):
    """A setting or a socket's value as something that compares."""
    if isinstance(item, (str, int, float, type(None))):
        return item
    return item.name_full if isinstance(item, bpy.types.ID) else tuple(item)


def tree_of(tree):
    """All that a node tree says, its groups included."""
    ends = [(item.from_socket, item.to_socket, item.is_muted) for item in tree.links]
    found = {"links": {(a.path_from_id(), b.path_from_id(), muted) for a, b, muted in ends}}
    for node in tree.nodes:
        names = ("bl_idname", "label", "location", "mute", "image", "extension", "interpolation")
        settings = [value_of(getattr(node, name, None)) for name in names]
        values = [value_of(getattr(item, "default_value", None)) for item in node.inputs]
        inner = getattr(node, "node_tree", None)
        found[node.name] = (settings, values, tree_of(inner) if inner else None)
    return found


def all_of():
    """Trees and properties of all materials, and what images there are."""
    pictures = {(i.name_full, i.colorspace_settings.name, i.alpha_mode) for i in bpy.data.images}
    known = bpy.data.materials
    return {m.name_full: (sorted(m.keys()), tree_of(m.node_tree)) for m in known}, pictures


def shown():
    """What is read of the Base Color now."""
    values = made.read()
    assert not values.problems, values.problems
    return next(item for item in values.materials if item.name == "Body").maps["base_color"]


def assert_shows(path):
    """The texels that are read are those of the file."""
    texture = shown().texture
    wanted = native.image().read(path, as_linear=False)[0]  # as they are in the file
    assert texture.encoded == path.endswith(".png")
    # Blender decodes 16 bits by a quick power: up to 0.7 of a code value away.
    np.testing.assert_allclose(texture.pixels, wanted, rtol=0, atol=texture.encoded / 65535)


@contextmanager
def showing(path):
    """Shows the file for a while; then all is as it was."""
    values, before = made.read(), all_of()
    text = images.show(values, "Body", path)
    assert_shows(path)
    yield text
    images.restore("Body")
    assert all_of() == before


def assert_refused(path, *words):
    """Says why, and leaves all as it was."""
    values, before = made.read(), all_of()
    with pytest.raises(BadInput) as caught:
        images.show(values, "Body", path)
    assert all(word in str(caught.value) for word in words), caught.value
    assert all_of() == before


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_a_constant_colour_gets_an_image_node(tmp_path, kind):
    socket = made.socket(body(), "base_color")
    path, _ = fitted(tmp_path, kind)
    with showing(path) as text:
        assert text.startswith("Material 'Body'") and path in text
        node = socket.links[0].from_node
        assert (node.interpolation, node.extension, node.projection) == ("Linear", "REPEAT", "FLAT")
        assert node.location.x < socket.node.location.x
        assert tuple(socket.default_value) == (0.25, 0.5, 0.75, 1)


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_an_image_node_gets_another_image(tmp_path, kind):
    material, node = textured(tmp_path)
    tree = material.node_tree
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(node.outputs["Color"], reroute.inputs[0])
    link(material, reroute.outputs[0])
    place, links = shown().uv, tree_of(tree)["links"]
    with showing(fitted(tmp_path, kind)[0]) as text:
        assert f"'{node.name}'" in text
        assert tree_of(tree)["links"] == links
        found = shown()
        assert (found.texture.extension, found.texture.interpolation) == ("EXTEND", "Closest")
        np.testing.assert_array_equal(found.uv, place)


@pytest.mark.parametrize("shared", ["Color", "Alpha", "reroute"])
def test_an_image_that_others_use_keeps_its_node(tmp_path, shared):
    material, node = textured(tmp_path)
    node.texture_mapping.vector_type = "TEXTURE"
    tree, old = material.node_tree, node.image
    output = node.outputs["Alpha" if shared == "Alpha" else "Color"]
    if shared == "reroute":
        reroute = tree.nodes.new("NodeReroute")
        tree.links.new(output, reroute.inputs[0])
        output = reroute.outputs[0]
        link(material, output)
    link(material, output, "emission_color")
    place = shown().uv
    with showing(fitted(tmp_path)[0]) as text:
        assert "copy of" in text
        assert node.image == old
        assert made.socket(material, "emission_color").links[0].from_socket == output
        copy = made.socket(material, "base_color").links[0].from_node
        assert copy != node and len(copy.outputs["Color"].links) == 1
        assert copy.texture_mapping.vector_type == "TEXTURE"
        assert shown().texture.extension == "EXTEND"
        np.testing.assert_array_equal(shown().uv, place)


@pytest.mark.parametrize("state", ["linked", "link muted", "node muted", "no image", "alpha"])
def test_another_link_makes_room(tmp_path, state):
    material = body()
    node = add(material.node_tree, "VertexColor", layer_name="Paint")
    if state in ("no image", "alpha"):
        node = add(material.node_tree, "TexImage")
    found = link(material, node.outputs["Alpha" if state == "alpha" else "Color"])
    found.is_muted, node.mute = state == "link muted", state == "node muted"
    with showing(fitted(tmp_path)[0]) as text:
        assert ("a new one" in text) == (state != "no image")


def test_each_restore_takes_one_show_back(tmp_path):
    textured(tmp_path)
    first, (second, colours) = fitted(tmp_path)[0], fitted(tmp_path, seed=2)
    with showing(first):
        images.show(made.read(), "Body", second)
        assert_shows(second)
        native.image().write_png(second, 1 - colours, bit_depth=16)
        images.show(made.read(), "Body", second)
        assert_shows(second)  # as it is now
        images.restore("Body")
        images.restore("Body")
        assert_shows(first)
    images.restore("Body")  # nothing is noted any more


def test_the_same_image_with_other_settings_stays_as_it_is(tmp_path):
    material = body()
    path, _ = fitted(tmp_path)
    own = bpy.data.images.load(path)
    own.colorspace_settings.name = "Non-Color"
    link(material, add(material.node_tree, "TexImage", image=own).outputs["Color"], "roughness")
    with showing(path):
        assert own.colorspace_settings.name == "Non-Color"


def test_links_that_were_made_since_are_kept(tmp_path):
    material = body()
    path, _ = fitted(tmp_path)
    images.show(made.read(), "Body", path)
    paint = add(material.node_tree, "VertexColor", layer_name="Paint")
    link(material, paint.outputs["Color"])
    images.show(made.read(), "Body", path)  # notes what stands there now
    assert_shows(path)
    socket = made.socket(material, "base_color")
    for _ in range(2):
        images.restore("Body")
        assert socket.links[0].from_socket == paint.outputs["Color"]
    assert "Image Texture" not in material.node_tree.nodes
    images.show(made.read(), "Body", path)
    link(material, paint.outputs["Alpha"])
    images.restore("Body")
    assert socket.links[0].from_socket == paint.outputs["Alpha"]


def test_what_is_gone_meanwhile_is_passed_over(tmp_path):
    material, node = textured(tmp_path)
    old, (path, _) = node.image, fitted(tmp_path)
    images.show(made.read(), "Body", path)
    bpy.data.images.remove(old)
    images.restore("Body")
    assert node.image.filepath == path
    images.show(made.read(), "Body", path)
    material.node_tree.nodes.remove(node)
    images.restore("Body")
    # Blender keeps an empty group of Cycles' settings where they were looked at.
    assert set(material.keys()) <= {"cycles"} and not bpy.data.images
    images.show(made.read(), "Body", path)
    bpy.data.materials.remove(material)
    images.restore("Body")


def test_what_was_saved_and_renamed_is_restored(tmp_path):
    _, node = textured(tmp_path)
    name = node.image.name
    with showing(fitted(tmp_path)[0]):
        bpy.ops.wm.open_mainfile(filepath=made.save(tmp_path / "scene.blend"))
        material, old = bpy.data.materials["Body"], bpy.data.images[name]
        material.name = old.name = "Renamed"
        images.restore("Body")
        material.name, old.name = "Body", name


def test_undo_takes_the_image_away_and_redo_brings_it_back(tmp_path):
    textured(tmp_path)
    before = all_of()
    undo_steps.prepare()
    with showing(fitted(tmp_path)[0]):
        bpy.ops.ed.undo_push(message="shown")
        undo_steps.undo()
        images.restore("Body")
        assert all_of() == before
        undo_steps.redo()
        assert all_of() != before


def test_an_image_inside_a_group_is_replaced_if_it_feeds_nothing_else(tmp_path):
    material = body()
    node, inner = picture_group(material.node_tree, tmp_path)
    link(material, node.outputs[0])
    path, _ = fitted(tmp_path)
    with showing(path):
        assert inner.image.filepath == path
    link(material, node.outputs[0], "emission_color")
    assert_refused(path, "through a node group", "of its own")


def test_a_principled_in_a_shared_group_takes_the_image_from_outside(tmp_path):
    """Where nothing in the group needs to change."""
    material = body()
    outer = material.node_tree
    node, entry, leave = group(outer, "Shader")
    inside = add(leave.id_data, "BsdfPrincipled")
    leave.id_data.links.new(entry.outputs[0], inside.inputs["Base Color"])
    leave.id_data.links.new(inside.outputs[0], leave.inputs[0])
    outer.links.new(node.outputs[0], outer.get_output_node("CYCLES").inputs["Surface"])
    other = made.material("Other")
    add(other.node_tree, "Group", node_tree=leave.id_data)
    first, second = fitted(tmp_path)[0], fitted(tmp_path, seed=2)[0]
    before = tree_of(leave.id_data)
    with showing(first):
        assert node.inputs[0].links[0].from_node.bl_idname == "ShaderNodeTexImage"
        assert tree_of(leave.id_data) == before
        images.show(made.read(), "Body", second)
        assert_shows(second)
        images.restore("Body")
    bpy.data.materials.remove(other)  # then the group may be changed
    with showing(first):
        assert inside.inputs[0].links[0].from_node.bl_idname == "ShaderNodeTexImage"


def test_shared_groups_are_refused(tmp_path):
    path, _ = fitted(tmp_path)
    material = body()
    outer, _, leave = group(material.node_tree)
    inner, _ = picture_group(leave.id_data, tmp_path)
    leave.id_data.links.new(inner.outputs[0], leave.inputs[0])
    link(material, outer.outputs[0])
    add(made.material("Other").node_tree, "Group", node_tree=leave.id_data)
    assert (outer.node_tree.users, inner.node_tree.users) == (2, 1)
    assert_refused(path, "'Body'", "node group 'Group', which has 2 users", "make it single-user")


def test_libraries_are_refused(tmp_path):
    path, _ = fitted(tmp_path)
    material = body()
    material.use_fake_user = True
    library = made.save(tmp_path / "library.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.materials = ["Body"]
    made.triangle(material=bpy.data.materials["Body"])
    assert_refused(path, "'Body'", "library.blend", "make it local")


@pytest.mark.parametrize("file", ["missing.png", "text.png", "text.exr", "text.txt"])
def test_a_file_that_is_no_image_changes_nothing(tmp_path, file):
    textured(tmp_path)
    for name in ("text.png", "text.exr", "text.txt"):
        (tmp_path / name).write_text("This is no image.")
    words = {"missing.png": "does not exist", "text.txt": "neither .png nor .exr"}
    for _ in ("nothing shown", "an image shown"):
        path = str(tmp_path / file)
        assert_refused(path, f"Image '{path}'", words.get(file, "cannot be read"))
        images.show(made.read(), "Body", fitted(tmp_path)[0])


def test_materials_without_a_base_colour_are_refused(tmp_path):
    path, _ = fitted(tmp_path)
    material = body()
    values = made.read()
    material.node_tree.nodes.remove(made.principled(material))
    assert_refused(path, "Surface")
    bpy.data.materials.remove(material)
    for name in ("Body", "Nobody"):
        with pytest.raises(BadInput, match=f"'{name}': it is gone"):
            images.show(values, name, path)


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_cycles_renders_the_texels(tmp_path, kind):
    """A diffuse plane under a white world has its colour, without noise: a texel is a pixel."""
    material = made.material()
    inputs = made.principled(material).inputs
    inputs["Specular IOR Level" if "Specular IOR Level" in inputs else "Specular"].default_value = 0
    node = add(material.node_tree, "TexImage", interpolation="Closest")
    link(material, node.outputs["Color"])
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.scale = (*SIZE, 1)
    bpy.context.object.data.materials.append(material)
    made.camera(type="ORTHO", ortho_scale=SIZE[0], sensor_fit="HORIZONTAL")
    made.world((1, 1, 1))
    path, colours = fitted(tmp_path, kind)
    images.show(made.read(), "Body", path)
    found = cycles.render(bpy.context.scene, "Camera", SIZE, 4, 1, tmp_path / "cycles.exr")
    rtol = 0.015 if bpy.app.version < (4, 0, 0) else 1e-3  # no Lambertian lobe in Blender 3
    np.testing.assert_allclose(found, colours, rtol=rtol, atol=1e-4)
