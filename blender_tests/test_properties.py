# SPDX-License-Identifier: GPL-3.0-or-later
"""Every property of this Blender has a class, and every value that is not modelled is named."""

import bpy
import known_properties
import made_scenes as made
import property_cases
import pytest

from selenite.cycles_check import render_settings
from selenite.scene_read.properties.rows import By, no_effect, table
from selenite.scene_read.properties.tables import TABLES

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

CASES = property_cases.cases()


def lines(read):
    """All that a reading of the open scene says."""
    return [item.line() for item in read.problems] + read.warnings


def test_every_property_of_this_blender_is_known():
    assert known_properties.unknown() == []


def test_a_property_that_the_table_lacks_is_found(monkeypatch):
    known = TABLES["Object"]
    rows = [row for row in known.rows if "pass_index" not in row.names]
    monkeypatch.setitem(TABLES, "Object", table("Object", *rows))
    assert "Object.pass_index (Pass Index)" in known_properties.unknown()


def test_a_property_of_a_newer_blender_is_named_where_it_is_set(monkeypatch):
    made.studio()
    known = TABLES["Object"]
    names = [n for row in known.rows if "pass_index" in row.names for n in row.names]
    names.remove("pass_index")
    rows = [row for row in known.rows if "pass_index" not in row.names]
    rows.append(no_effect(" ".join(names)))
    monkeypatch.setitem(TABLES, "Object", table("Object", *rows))
    assert not lines(made.read())
    bpy.data.objects["Body"].pass_index = 3
    assert made.read().warnings == [
        "Object 'Body': 'Pass Index' (pass_index) is 3, and this version of Selenite does not know "
        "what it does; set it to 0, or compare a render with Cycles"
    ]


def test_the_scene_that_blender_starts_with_gives_no_message():
    bpy.ops.wm.read_factory_settings(use_empty=False)
    bpy.context.scene.render.engine = "CYCLES"
    assert lines(made.read()) == []


def test_properties_of_other_add_ons_do_not_alarm(addon):
    """`addon` registers Selenite's own group."""
    made.studio()
    bpy.types.Scene.of_another = bpy.props.IntProperty(default=0)
    bpy.types.Object.of_another = bpy.props.BoolProperty(default=False)
    try:
        bpy.context.scene.of_another = 7
        bpy.data.objects["Body"].of_another = True
        bpy.data.objects["Body"]["custom"] = 1.5
        assert lines(made.read()) == []
    finally:
        del bpy.types.Scene.of_another, bpy.types.Object.of_another


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_a_value_that_is_not_modelled_is_named(case):
    place, said = property_cases.found_by(case)
    assert any(property_cases.is_named(case, place, item) for item in said), said


def test_findings_reach_the_values_of_a_scene():
    made.studio()
    scene = bpy.context.scene
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.use_motion_blur = True
    read = made.read()
    assert [item.object for item in read.problems] == ["Scene 'Scene'"]
    assert "cropped to the render region" in read.problems[0].cause
    assert "Scene 'Scene': motion blur is not modelled" in read.warnings[0]
    assert "switch off Motion Blur" in read.warnings[0]


def test_many_objects_with_one_fault_share_a_line():
    made.studio()
    for number in range(9):
        item = made.triangle(f"Part {number}")
        item.is_shadow_catcher = True
    found = [item for item in made.read().problems if "shadow catcher" in item.cause]
    assert len(found) == 1
    assert found[0].object == "Objects 'Part 0', 'Part 1', 'Part 2', 'Part 3' and 5 more"


def test_remarks_on_render_settings_are_those_of_the_table():
    """What the table leaves to the remarks is a setting that they judge, and the reverse."""
    paths = {"RenderSettings": "render", "CyclesRenderSettings": "cycles",
             "ColorManagedViewSettings": "view_settings"}  # fmt: skip
    left = {
        f"{paths[name]}.{row.names[0]}"
        for name in paths
        for row in TABLES[name].rows
        if row.by is By.REMARK
    }
    judged = {row.path for row in render_settings.SETTINGS if row.spoils is not None}
    assert left == judged
