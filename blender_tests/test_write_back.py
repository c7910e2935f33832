# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing values back: identity, all or nothing, and what is refused."""

import bpy
import made_scenes as made
import pytest

from selenite import parameters, write_back
from selenite.problems import BadInput
from selenite.scene_read.build import build
from selenite.scene_read.shading import materials

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def _between(parameter, share):
    """A value inside the range, another one for each channel, exact in single precision."""
    high = min(parameter.upper, 4.0)
    low = max(parameter.lower, 0.0)
    steps = range(parameter.width)
    return tuple(round(64 * (low + (high - low) * (share + 0.1 * i))) / 64 for i in steps)


def test_every_parameter_makes_the_round_trip_unchanged():
    """Blender -> native -> Blender -> native gives the same numbers, bit for bit."""
    material = made.studio()
    made.light(energy=3)
    owners = made.read().owners
    wanted = {}
    for owner in owners.values():
        for index, parameter in enumerate(parameters.of(owner.kind)):
            if parameter.name not in owner.fixed:
                wanted[owner.name, parameter.name] = _between(parameter, 0.3 + 0.02 * index)
    assert {"base_color", "roughness", "ior", "transmission"} <= {name for _, name in wanted}
    write_back.write(bpy.context.scene, owners, wanted)
    scene = build(made.read())
    for key, value in wanted.items():
        assert tuple(scene.get(*key)) == value, key
    native_values = {key: tuple(scene.get(*key)) for key in wanted}
    write_back.write(bpy.context.scene, made.read().owners, native_values)
    again = made.read().owners
    for (owner, name), value in wanted.items():
        assert again[owner].values[name] == value
    assert made.socket(material, "base_color").default_value[3] == 1.0  # the fourth channel stays


def test_parameters_that_this_blender_lacks_say_so():
    made.studio()
    owner = made.read().owners["Body"]
    for parameter in parameters.of("material"):
        node = made.principled(bpy.data.materials["Body"])
        if parameter.sockets and parameter.find(node) is None:
            assert "no such input" in owner.fixed[parameter.name]


def test_what_stood_there_is_returned_and_restores():
    made.studio(roughness=0.25)
    scene, owners = bpy.context.scene, made.read().owners
    before = write_back.write(scene, owners, {("Body", "roughness"): (0.75,)})
    assert before == {("Body", "roughness"): (0.25,)}
    write_back.write(scene, owners, before)
    assert made.read().owners["Body"].values["roughness"] == (0.25,)


@pytest.mark.parametrize("value", [float("nan"), 7.0, -0.5])
def test_values_out_of_range_are_refused_and_nothing_is_written(value):
    material = made.studio(roughness=0.25, ior=1.5)
    wanted = {("Body", "ior"): (1.25,), ("Body", "roughness"): (value,)}
    with pytest.raises(BadInput) as error:
        write_back.write(bpy.context.scene, made.read().owners, wanted)
    assert "Body:roughness" in str(error.value)
    assert made.socket(material, "ior").default_value == 1.5


def _driven(material):
    made.socket(material, "roughness").driver_add("default_value")


def _keyframed(material):
    made.socket(material, "roughness").keyframe_insert("default_value", frame=1)


def _linked(material):
    node = material.node_tree.nodes.new("ShaderNodeValue")
    material.node_tree.links.new(node.outputs[0], made.socket(material, "roughness"))


def _replaced(material):
    tree = material.node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])


def _removed(material):
    bpy.data.materials.remove(material)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_driven, "driven"),
        (_keyframed, "keyframed"),
        (_linked, "linked to node"),
        (_replaced, "Diffuse BSDF"),
        (_removed, "is gone"),
    ],
)
def test_changes_after_the_fit_are_noticed_and_nothing_is_written(change, words):
    material = made.studio(roughness=0.25)
    lamp = made.light(energy=3).data
    owners = made.read().owners
    change(material)
    wanted = {("Key", "power"): (5.0,), ("Body", "roughness"): (0.75,)}
    with pytest.raises(BadInput) as error:
        write_back.write(bpy.context.scene, owners, wanted)
    assert words in str(error.value)
    assert lamp.energy == 3


def test_library_material_is_refused(tmp_path):
    made.material("Far", roughness=0.25).use_fake_user = True
    library = made.save(tmp_path / "library.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.materials = ["Far"]
    made.triangle(material=bpy.data.materials["Far"])
    owners = made.read().owners
    assert owners["Far"].values["roughness"] == (0.25,)
    assert "library.blend" in owners["Far"].fixed["roughness"]
    with pytest.raises(BadInput, match="library"):
        write_back.write(bpy.context.scene, owners, {("Far", "roughness"): (0.75,)})


def test_a_lamp_of_two_objects_is_written_once_and_all_or_nothing():
    lamp = made.light(energy=3)
    made.add("Second", lamp.data)
    material = made.studio(roughness=0.25)
    owners = made.read().owners
    assert [name for name in owners if owners[name].kind == "light"] == ["Key"]
    wanted = {("Key", "power"): (8.0,), ("Key", "color"): (0.25, 0.5, 0.75)}
    before = write_back.write(bpy.context.scene, owners, wanted)
    assert before == {("Key", "power"): (3.0,), ("Key", "color"): (1.0, 1.0, 1.0)}
    assert lamp.data.energy == 8 and tuple(lamp.data.color) == (0.25, 0.5, 0.75)
    with pytest.raises(BadInput):
        worse = {("Key", "power"): (5.0,), ("Body", "roughness"): (7.0,)}
        write_back.write(bpy.context.scene, owners, worse)
    assert lamp.data.energy == 8 and made.socket(material, "roughness").default_value == 0.25


def test_renamed_world_and_missing_world_are_noticed():
    made.studio()
    owners = made.read().owners
    bpy.context.scene.world = None
    with pytest.raises(BadInput, match="world is gone"):
        write_back.write(bpy.context.scene, owners, {("World", "strength"): (2.0,)})


def test_find_source_reports_material_without_nodes():
    material = bpy.data.materials.new("Old")
    material.use_nodes = False
    row = parameters.table()["material", "roughness"]
    assert "Use Nodes" in materials.find_source(material, row)[1]
