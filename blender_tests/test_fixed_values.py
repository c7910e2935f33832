# SPDX-License-Identifier: GPL-3.0-or-later
"""What holds a value in place, in corners of Blender that are easily forgotten: strips of the NLA,
muted links, and two materials of one name of which one is linked from a library."""

import bpy
import made_scenes as made
import pytest

from selenite import write_back
from selenite.problems import BadInput

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def fixed(parameter, owner="Body"):
    return made.read().owners[owner].fixed.get(parameter, "")


def push_down(block):
    """The action of a datablock becomes a strip of its NLA: nothing is left in the action slot."""
    data = block.animation_data
    action, data.action = data.action, None
    data.nla_tracks.new().strips.new("strip", 1, action)


def test_keyframes_of_an_nla_strip_hold_a_socket():
    material = made.studio()
    made.socket(material, "roughness").keyframe_insert("default_value", frame=1)
    assert "keyframed" in fixed("roughness")
    push_down(material.node_tree)
    assert material.node_tree.animation_data.action is None
    assert "keyframed" in fixed("roughness") and not fixed("ior")


def test_keyframes_of_an_nla_strip_hold_a_lamp():
    made.studio()
    data = made.light(energy=5).data
    data.keyframe_insert("energy", frame=1)
    push_down(data)
    assert "keyframed" in fixed("power", "Key") and not fixed("color", "Key")


def test_a_muted_link_is_no_link():
    material = made.studio(base_color=(0.1, 0.2, 0.3))
    occlusion = material.node_tree.nodes.new("ShaderNodeAmbientOcclusion")
    link = made.link(material, occlusion.outputs[0])
    assert made.read().problems
    link.is_muted = True
    values = made.read()
    assert not values.problems and not fixed("base_color")
    assert values.owners["Body"].values["base_color"] == pytest.approx((0.1, 0.2, 0.3))
    write_back.write(bpy.context.scene, values.owners, {("Body", "base_color"): (0.5, 0.25, 0.125)})
    found = made.read().owners["Body"].values["base_color"]
    assert found == pytest.approx((0.5, 0.25, 0.125))


@pytest.fixture
def namesakes(tmp_path):
    """A local material 'Body' on one ball and one of that name from a library on another."""
    made.studio(roughness=0.7)
    library = made.save(tmp_path / "library.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio(roughness=0.2)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.materials = ["Body"]
    (linked,) = wanted.materials
    item = made.sphere("Other", linked)
    item.location = (3, 0, 0)
    return linked


def test_materials_of_one_name_are_told_apart_by_their_library(namesakes):
    values = made.read()
    owners = [item for item in values.owners.values() if item.kind == "material"]
    assert sorted(item.values["roughness"][0] for item in owners) == pytest.approx([0.2, 0.7])
    for owner in owners:
        block = write_back.datablock(bpy.data.materials, owner)
        assert made.socket(block, "roughness").default_value == pytest.approx(
            owner.values["roughness"][0]
        )
        reason = owner.fixed.get("roughness", "")
        assert ("linked from library" in reason) == (block.library is not None)
        assert ("library.blend" in reason) == (block.library is not None)
        assert bool(owner.library) == (block.library is not None)


def test_only_the_local_one_is_written(namesakes):
    values = made.read()
    names = {bool(item.library): name for name, item in values.owners.items()
             if item.kind == "material"}  # fmt: skip
    scene = bpy.context.scene
    write_back.write(scene, values.owners, {(names[False], "roughness"): (0.5,)})
    assert made.socket(namesakes, "roughness").default_value == pytest.approx(0.7)
    with pytest.raises(BadInput, match="library"):
        write_back.write(scene, values.owners, {(names[True], "roughness"): (0.5,)})
    assert made.socket(namesakes, "roughness").default_value == pytest.approx(0.7)
