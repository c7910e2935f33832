# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps over a floor against Cycles: parents that shear and stretch, several places, nodes."""

import math

import bpy
import made_scenes as made
import numpy as np
import pytest
from strips import render_both

from selenite import write_back
from selenite.scene_read.build import build

pytestmark = [pytest.mark.blender, pytest.mark.slow]

SIZE = (12, 12)
SAMPLES = 1024
#: Even scales of a parent, uneven ones, and a turn between them that shears what hangs on it.
EVEN, UNEVEN, TURNED = (1.5, 1.5, 1.5), (3.0, 1.0, 0.5), (0.4, 0.3, 0.2)
HARD = {"shadow_soft_size": 0.0}


def floor(size=SIZE):
    """A diffuse floor under all that the camera of `render_both` sees."""
    material = made.material("Floor", base_color=(0.8, 0.8, 0.8), roughness=1.0)
    inputs = made.principled(material).inputs
    level = "Specular IOR Level" if "Specular IOR Level" in inputs else "Specular"
    inputs[level].default_value = 0
    mesh = bpy.data.meshes.new("Floor")
    x, y = size
    mesh.from_pydata(
        [(-x, -y, 0), (2 * x, -y, 0), (2 * x, 2 * y, 0), (-x, 2 * y, 0)], [], [range(4)]
    )
    mesh.materials.append(material)
    made.add("Floor", mesh)


def lamp(kind, turn=(0.5, -0.3, 0.4), at=(6.0, 6.0, 3.0), name="Key", **settings):
    """A lamp above the middle of the floor."""
    usual = {"energy": 3.0 if kind == "SUN" else 400.0}
    if kind == "SPOT":  # a wide cone with a soft edge, which few samples render well
        usual |= {"spot_size": 1.4, "spot_blend": 1.0}
    item = made.light(name, kind, **{**usual, **settings})
    item.location, item.rotation_euler = at, turn
    return item


def hang(item, scale, turn):
    """Gives an object a parent at its place, with a scale and a turn."""
    parent = made.add("Parent", None)
    parent.location, parent.scale, parent.rotation_euler = item.location, scale, turn
    item.parent, item.location = parent, (0, 0, 0)
    return item


def lamp_problems(values):
    """Without that of a camera, which only what renders adds."""
    return [item for item in values.problems if "camera" not in item.cause]


def assert_equals_cycles(native, folder, mean=0.01, pixel=0.06, samples=SAMPLES):
    """mean: of the picture's, relative; pixel: of each one's, by the brightest."""
    ours, cycles = render_both(native, folder, SIZE, samples)
    assert cycles.mean() > 0.002  # there is something to compare
    assert ours.mean() == pytest.approx(cycles.mean(), rel=mean)
    assert np.abs(ours - cycles).max() < pixel * cycles.max()


LAMPS = {
    "point": ("POINT", HARD),
    "soft point": ("POINT", {"shadow_soft_size": 0.5}),
    "spot": ("SPOT", {**HARD, "spot_size": 0.9, "spot_blend": 0.3}),
    "soft spot": ("SPOT", {"shadow_soft_size": 0.4, "spot_size": 0.9, "spot_blend": 0.3}),
    "sun": ("SUN", {"angle": 0.0}),
    "soft sun": ("SUN", {"angle": 0.2}),
}
AREAS = {
    "square": {"shape": "SQUARE", "size": 1.0},
    "rectangle": {"shape": "RECTANGLE", "size": 1.0, "size_y": 0.4},
    "disk": {"shape": "DISK", "size": 1.0},
    "ellipse": {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.4},
    "spread": {"shape": "SQUARE", "size": 1.0, "spread": 1.5},
}
FRAMES = {
    "even": (EVEN, TURNED),
    "mirrored": ((-1.0, 1.0, 1.0), TURNED),
    "flipped": ((1.0, 1.0, -1.0), (math.pi, 0, 0)),
}
#: Blender 3.4 is asked for one of them: how a parent turns a lamp is the same there.
PARENTS = ["even", pytest.param("mirrored", marks=pytest.mark.blender34), "flipped"]
SHEARS = {"stretched": (UNEVEN, (0, 0, 0)), "sheared": (UNEVEN, TURNED)}


@pytest.mark.parametrize("frame", PARENTS)
@pytest.mark.parametrize("name", LAMPS)
def test_lamps_under_a_parent(native, tmp_path, name, frame):
    floor()
    kind, settings = LAMPS[name]
    hang(lamp(kind, **settings), *FRAMES[frame])
    assert_equals_cycles(native, tmp_path)


def is_spot_of_a_light_tree(name):
    """Blender 3 has no light tree, and its spots are round whatever the scale."""
    return LAMPS[name][0] == "SPOT" and bpy.app.version >= (4, 0, 0)


@pytest.mark.blender34
@pytest.mark.parametrize("frame", SHEARS)
@pytest.mark.parametrize("name", LAMPS)
def test_lamps_that_a_parent_shears(native, tmp_path, name, frame):
    if is_spot_of_a_light_tree(name):
        pytest.skip("refused, see below")
    floor()
    kind, settings = LAMPS[name]
    hang(lamp(kind, **settings), *SHEARS[frame])
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
@pytest.mark.parametrize("scale", [(2.0, 0.5, 1.0), (1.0, 1.0, 0.4), (-1.0, 1.0, 1.0)])
def test_spots_with_an_uneven_scale_of_their_own(native, tmp_path, scale):
    floor()
    hang(lamp("SPOT", **LAMPS["spot"][1]), EVEN, TURNED).scale = scale
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
@pytest.mark.parametrize("frame", SHEARS)
@pytest.mark.parametrize("name", ["spot", "soft spot"])
def test_a_sheared_spot_is_refused_by_name(name, frame):
    """The light tree of Cycles 4 leaves out what lies outside a narrower cone."""
    if not is_spot_of_a_light_tree(name):
        pytest.skip("rendered, see above")
    floor()
    hang(lamp("SPOT", **LAMPS[name][1]), *SHEARS[frame])
    (problem,) = lamp_problems(made.read())
    assert problem.object == "Light 'Key'" and "light tree" in problem.cause
    assert "scale" in problem.cure


@pytest.mark.parametrize("frame", PARENTS)
@pytest.mark.parametrize("name", AREAS)
def test_area_lamps_under_a_parent(native, tmp_path, name, frame):
    floor()
    hang(lamp("AREA", **AREAS[name]), *FRAMES[frame])
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
@pytest.mark.parametrize("name", AREAS)
def test_area_lamps_with_an_uneven_scale_of_their_own(native, tmp_path, name):
    floor()
    hang(lamp("AREA", **AREAS[name]), EVEN, TURNED).scale = (2.0, -0.5, 0.3)
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
@pytest.mark.parametrize("name", AREAS)
def test_a_sheared_area_lamp_is_refused_by_name(name):
    """Cycles samples it as if its sides were at right angles, so that its light is not its own."""
    floor()
    hang(lamp("AREA", **AREAS[name]), UNEVEN, TURNED)
    (problem,) = lamp_problems(made.read())
    assert problem.object == "Light 'Key'" and "shear" in problem.cause
    assert "scale" in problem.cure


@pytest.mark.blender34
def test_a_sheared_portal_is_none_of_ours():
    floor()
    item = hang(lamp("AREA"), UNEVEN, TURNED)
    item.data.cycles.is_portal = True
    values = made.read()
    assert not lamp_problems(values) and not values.lights
    assert any("portal" in text for text in values.warnings)


@pytest.mark.blender34
@pytest.mark.parametrize("shape", ["SQUARE", "RECTANGLE", "DISK", "ELLIPSE"])
def test_an_area_lamp_with_a_side_of_nothing_is_dark(native, tmp_path, shape):
    floor()
    lamp("POINT")
    uneven = shape in {"RECTANGLE", "ELLIPSE"}
    dark = lamp("AREA", name="Dark", shape=shape, size=1.0 if uneven else 0.0)
    if uneven:
        dark.data.size_y = 0.0
    values = made.read()
    assert [light.name for light in values.lights] == ["Key"] and not lamp_problems(values)
    assert any("'Dark'" in text and "a side of 0" in text for text in values.warnings)
    assert_equals_cycles(native, tmp_path)


def again(item, at, scale=(1.0, 1.0, 1.0)):
    """Another object of the same lamp."""
    other = made.add("Other", item.data)
    other.location, other.scale, other.rotation_euler = at, scale, (-0.4, 0.2, 0.0)
    return other


@pytest.mark.blender34
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_a_lamp_at_two_places_is_one_owner_and_two_lights(native, tmp_path, kind):
    floor()
    item = lamp(kind, at=(4.0, 4.0, 3.0), **(HARD if kind in {"POINT", "SPOT"} else {}))
    again(item, (8.0, 7.0, 2.0), (2.0, 0.5, 1.0))
    values = made.read()
    assert [light.name for light in values.lights] == ["Key", "Key"]
    assert [name for name, owner in values.owners.items() if owner.kind == "light"] == ["Key"]
    assert values.owners["Key"].fixed == {} and not lamp_problems(values)
    assert build(values).lights == ["Key", "Key"]  # a name for each place
    assert_equals_cycles(native, tmp_path, samples=4 * SAMPLES)  # either may find the wrong lamp


@pytest.mark.blender34
def test_a_lamp_at_two_places_is_written_once_and_changes_at_both(native):
    floor()
    item = lamp("POINT", at=(4.0, 4.0, 3.0), **HARD)
    again(item, (8.0, 7.0, 2.0))
    camera = made.camera(type="ORTHO", ortho_scale=12)
    camera.location = (6, 6, 5)
    values = made.read()
    before = write_back.write(bpy.context.scene, values.owners, {("Key", "power"): (800.0,)})
    assert before == {("Key", "power"): (400.0,)} and item.data.energy == 800

    def picture(scene):
        return native.core().render(scene, "Camera", 12, 12, 4).image

    changed = build(values).with_values({("Key", "power"): np.array([800.0])})
    np.testing.assert_allclose(picture(build(made.read())), picture(changed), rtol=1e-6)
    np.testing.assert_allclose(picture(changed), 2 * picture(build(values)), rtol=1e-5)


@pytest.mark.blender34
def test_instances_of_a_lamp_are_one_owner():
    floor()
    item = lamp("POINT")
    collection = bpy.data.collections.new("Lamps")
    collection.objects.link(item)
    bpy.context.scene.collection.objects.unlink(item)
    for number in range(3):
        holder = made.add(f"Holder {number}", None)
        holder.instance_type, holder.instance_collection = "COLLECTION", collection
        holder.location = (number, 0, 0)
    values = made.read()
    assert [light.name for light in values.lights] == ["Key"] * 3
    assert list(values.owners) == ["Floor", "Key"]
    places = {tuple(light.matrix[:3, 3].round(4)) for light in values.lights}
    assert places == {(6, 6, 3), (7, 6, 3), (8, 6, 3)}


@pytest.mark.blender34
def test_lamps_without_a_normalized_power_at_two_scales(native, tmp_path):
    floor()
    item = lamp("AREA", at=(4.0, 4.0, 3.0), energy=20)
    if not hasattr(item.data, "normalize"):
        pytest.skip("lamps are always normalized before Blender 4.5")
    item.data.normalize = False
    again(item, (8.0, 7.0, 2.0), (2.0, 0.5, 1.0))
    first, second = made.read().lights
    assert first.radiance_scale == pytest.approx(second.radiance_scale)  # 1 x 1 and 2 x 1/2
    assert_equals_cycles(native, tmp_path)


def emission(light, color=(1.0, 1.0, 1.0), strength=1.0):
    """The lamp's Emission node."""
    light.use_nodes = True
    tree = light.node_tree
    node = next(item for item in tree.nodes if item.bl_idname == "ShaderNodeEmission")
    node.inputs["Color"].default_value = (*color, 1.0)
    node.inputs["Strength"].default_value = strength
    return tree, node


def _plain(_tree, _node):
    pass


def _linked_color(tree, node):
    source = tree.nodes.new("ShaderNodeRGB")
    source.outputs[0].default_value = (0.2, 0.7, 0.4, 1.0)
    tree.links.new(source.outputs[0], node.inputs["Color"])


def _number_for_color(tree, node):
    source = tree.nodes.new("ShaderNodeValue")
    source.outputs[0].default_value = 0.6
    tree.links.new(source.outputs[0], node.inputs["Color"])


def _color_for_strength(tree, node):
    source = tree.nodes.new("ShaderNodeRGB")
    source.outputs[0].default_value = (0.9, 0.1, 0.05, 1.0)
    tree.links.new(source.outputs[0], node.inputs["Strength"])


def _grouped(tree, node):
    """The Emission node inside a group, its strength by an input of the group."""
    inner = bpy.data.node_groups.new("Lit", "ShaderNodeTree")
    if hasattr(inner, "interface"):
        inner.interface.new_socket("S", in_out="INPUT", socket_type="NodeSocketColor")
        inner.interface.new_socket("E", in_out="OUTPUT", socket_type="NodeSocketShader")
    else:
        inner.inputs.new("NodeSocketColor", "S")
        inner.outputs.new("NodeSocketShader", "E")
    entry, leave = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    shine = inner.nodes.new("ShaderNodeEmission")
    shine.inputs["Color"].default_value = (0.3, 0.9, 0.6, 1.0)
    inner.links.new(entry.outputs[0], shine.inputs["Strength"])
    inner.links.new(shine.outputs[0], leave.inputs[0])
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = inner
    outer.inputs[0].default_value = (0.5, 1.5, 0.25, 1.0)
    end = node.outputs[0].links[0].to_socket
    tree.links.new(outer.outputs[0], end)


@pytest.mark.blender34
@pytest.mark.parametrize(
    "change", [_plain, _linked_color, _number_for_color, _color_for_strength, _grouped]
)
@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_emission_nodes_of_lamps(native, tmp_path, kind, change):
    floor()
    item = lamp(kind, color=(1.0, 0.8, 0.5))
    change(*emission(item.data, (0.4, 0.6, 0.9), 1.7))
    values = made.read()
    assert not lamp_problems(values)
    assert set(values.owners["Key"].fixed) == {"color"}  # a product: which factor is not known
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
def test_emission_nodes_with_exposure_and_temperature(native, tmp_path):
    floor()
    item = lamp("AREA", shape="SQUARE", size=2)
    if not hasattr(item.data, "exposure"):
        pytest.skip("lamps have no exposure before Blender 4.5")
    item.data.exposure, item.data.normalize, item.data.energy = 1.0, False, 10
    item.data.use_temperature, item.data.temperature = True, 3000
    emission(item.data, (0.4, 0.6, 0.9), 1.7)
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
def test_the_power_of_a_lamp_with_nodes_is_written_back(native, tmp_path):
    floor()
    item = lamp("POINT", **HARD)
    emission(item.data, (0.4, 0.6, 0.9), 1.7)
    owners = made.read().owners
    write_back.write(bpy.context.scene, owners, {("Key", "power"): (250.0,)})
    assert item.data.energy == 250 and made.read().lights[0].power == 250
    assert_equals_cycles(native, tmp_path)


@pytest.mark.blender34
@pytest.mark.parametrize(
    ("kind", "output", "socket"),
    [
        ("ShaderNodeLightFalloff", "Linear", "Strength"),
        ("ShaderNodeTexNoise", "Color", "Color"),
    ],
)
def test_what_varies_in_a_lamp_is_refused_by_name(kind, output, socket):
    floor()
    tree, node = emission(lamp("POINT").data)
    source = tree.nodes.new(kind)
    source.label = "Odd"
    end = next(item for item in source.outputs if item.name == output)
    tree.links.new(end, node.inputs[socket])
    (problem,) = lamp_problems(made.read())
    assert problem.object == "Light 'Key'"
    assert "'Odd'" in problem.cause and socket in problem.cause and problem.cure


def _muted(_tree, node):
    node.mute = True


def _unlinked(tree, node):
    tree.links.remove(node.outputs[0].links[0])


def _diffuse(tree, node):
    end = node.outputs[0].links[0].to_socket
    tree.links.new(tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], end)


@pytest.mark.blender34
@pytest.mark.parametrize("change", [_muted, _unlinked, _diffuse])
def test_lamps_that_no_emission_lights_are_refused_by_name(change):
    floor()
    change(*emission(lamp("POINT").data))
    (problem,) = lamp_problems(made.read())
    assert problem.object == "Light 'Key'" and "Emission" in problem.cure
