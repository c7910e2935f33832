# SPDX-License-Identifier: GPL-3.0-or-later
"""The list of parameters as people think: groups, labels, search, order, the usual ticks."""

from types import SimpleNamespace

import bpy
import made_scenes as made
import pytest
from drawn_panels import FakeLayout, draw

from selenite.interface import panels
from selenite.interface.rows import details, lists
from selenite.interface.rows.labels import with_labels
from selenite.interface.texts import text_width, wrapped
from selenite.scene_read import hosts

pytestmark = [pytest.mark.blender, pytest.mark.blender34, pytest.mark.usefixtures("addon")]

FLAG = 1 << 30


@pytest.fixture
def settings():
    """Two materials, the one of the active object not the first by name; a lamp; the world."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.hidden_ball()
    made.light()
    bpy.context.view_layer.objects.active = bpy.data.objects["Behind"]
    bpy.ops.selenite.refresh_rows()
    return bpy.context.scene.selenite


def row_of(settings, owner, parameter):
    return next(row for row in settings.rows if (row.owner, row.parameter) == (owner, parameter))


def listed(settings, search=""):
    """(owner, parameter) of the rows that the list shows."""
    flags = lists.shown(settings.rows, settings, search, FLAG)
    return [
        (row.owner, row.parameter) for row, flag in zip(settings.rows, flags, strict=True) if flag
    ]


def test_the_material_of_the_active_object_comes_first(settings):
    assert [item.name for item in settings.owners] == ["Hidden", "Body", "Behind", "Key", "World"]
    assert settings.active_owner == 0
    bpy.context.view_layer.objects.active = next(
        item for item in bpy.data.objects if item.active_material == bpy.data.materials["Body"]
    )
    bpy.ops.selenite.refresh_rows()
    assert [item.name for item in settings.owners][:2] == ["Body", "Hidden"]
    assert settings.owners[settings.active_owner].name == "Hidden"  # as the user had it


def test_only_the_active_group_is_listed_and_no_locked_row(settings):
    made.socket(bpy.data.materials["Hidden"], "ior").driver_add("default_value")
    bpy.ops.selenite.refresh_rows()
    assert {owner for owner, _ in listed(settings)} == {"Hidden"}
    assert ("Hidden", "ior") not in listed(settings)
    settings.show_locked = True
    assert ("Hidden", "ior") in listed(settings)
    row = row_of(settings, "Hidden", "ior")
    assert row.reason and row.reason in row.tip and "Hidden:ior" in row.tip
    settings.active_owner = 3
    assert listed(settings) == [("Key", "power"), ("Key", "color")]


def test_search_finds_labels_owners_and_names_of_all_groups(settings):
    assert set(listed(settings, "rough")) >= {("Hidden", "roughness"), ("Body", "roughness")}
    assert listed(settings, "body ior")[0] == ("Body", "ior")
    assert listed(settings, "no such thing") == []
    assert all(row.name == row.label for row in settings.rows)  # what Blender searches


def test_rows_sort_by_their_labels(settings):
    places = lists.by_label(settings.rows)
    assert sorted(places) == list(range(len(settings.rows)))
    ordered = [row.label for _, row in sorted(zip(places, settings.rows, strict=True))]
    assert ordered == sorted(ordered, key=str.casefold)


def test_labels_are_those_of_the_node(settings):
    node = made.socket(bpy.data.materials["Body"], "base_color").node
    names = {item.name for item in node.inputs}
    for row in settings.rows:
        if row.kind == "material" and row.parameter in ("base_color", "transmission", "ior"):
            assert row.label in names
    expected = "Transmission" if hosts.is_version_3() else "Transmission Weight"
    assert row_of(settings, "Body", "transmission").label == expected
    assert row_of(settings, "Key", "power").label == "Power"
    assert row_of(settings, "Key", "power").value.endswith(" W")


def test_colours_have_swatches(settings):
    row = row_of(settings, "Body", "base_color")
    assert row.is_colour and tuple(row.current) == pytest.approx((0.8, 0.4, 0.2))
    assert not row_of(settings, "Body", "roughness").is_colour


@pytest.mark.parametrize(
    ("group", "expected"),
    [
        ("Body", {"base_color", "roughness", "transmission", "ior"}),
        ("Key", {"power"}),
        ("World", {"strength"}),
    ],
)
def test_usual_ticks_in_one_click(settings, group, expected):
    names = [item.name for item in settings.owners]
    settings.active_owner = names.index(group)
    assert bpy.ops.selenite.tick_usual() == {"FINISHED"}
    ticked = {(row.owner, row.parameter) for row in settings.rows if row.enabled}
    assert ticked == {(group, name) for name in expected}
    assert bpy.ops.selenite.untick() == {"FINISHED"}
    assert not any(row.enabled for row in settings.rows)


def test_details_are_always_as_high(settings):
    heights = set()
    settings.show_locked = True
    for row in [None, *settings.rows]:
        lines = _Lines()
        details.draw(lines, SimpleNamespace(region=None), row)
        heights.add(lines.count[0])
    assert len(heights) == 1, heights


class _Lines:
    """Counts the lines of a column, where a row is one line."""

    def __init__(self, count=None, inside=False):
        self.count, self.inside = count or [0], inside

    def box(self):
        return self

    def column(self, **_options):
        return self

    def row(self, **_options):
        self._add()
        return _Lines(self.count, inside=True)

    def _add(self):
        if not self.inside:
            self.count[0] += 1

    def label(self, **_options):
        self._add()

    def prop(self, *_words, **_options):
        self._add()


def test_the_material_panel_lists_what_can_be_fitted(settings):
    material = bpy.data.materials["Body"]
    context = SimpleNamespace(scene=bpy.context.scene, material=material)
    from drawn_panels import FakeLayout

    layout = FakeLayout()
    panels.SELENITE_PT_material.draw(SimpleNamespace(layout=layout), context)
    assert row_of(settings, "Body", "roughness").label in layout.drawn
    assert panels.SELENITE_PT_material.poll(context)
    assert not panels.SELENITE_PT_material.poll(SimpleNamespace(material=None))


def test_the_head_names_the_next_step(settings):
    assert "selenite.load_photos" in draw(panels.SELENITE_PT_head)
    capture = settings.captures.add()
    capture.camera = bpy.context.scene.camera
    capture.photo = bpy.data.images.new("Photo", 4, 4)
    assert "selenite.tick_usual" in draw(panels.SELENITE_PT_head)
    bpy.ops.selenite.tick_usual()
    assert "selenite.start" in draw(panels.SELENITE_PT_head)


def drawn_row(row, width):
    """What the list draws of a row in a region of so many pixels."""
    layout = FakeLayout()
    scale = bpy.context.preferences.system.ui_scale or 1.0
    region = SimpleNamespace(width=width * scale)
    context = SimpleNamespace(
        scene=bpy.context.scene, preferences=bpy.context.preferences, region=region
    )
    lists.SELENITE_UL_rows.draw_item(None, context, layout, None, row, 0, None, "")
    return layout.drawn


def test_no_name_is_cut_where_the_sidebar_is_as_narrow_as_it_opens(settings):
    row = row_of(settings, "Hidden", "roughness")
    row.label = "Transmission Roughness"
    assert "Transmission Roughness" in drawn_row(row, 400) and row.value in drawn_row(row, 400)
    name = next(item for item in drawn_row(row, 199) if "Roughness" in item)
    assert name.startswith("Trans") and name.endswith(". Roughness")
    assert row.value not in drawn_row(row, 199), "a value beside it would cut the name"
    room = 199 - lists._TAKEN - lists._MARGIN
    for item in (row for row in settings.rows if row.owner == "Hidden"):
        drawn = [text for text in drawn_row(item, 199) if text and text != item.value]
        assert text_width(drawn[-1]) <= room or " " not in item.label, drawn


def test_a_number_stays_with_its_per_cent():
    assert wrapped("bias 1.43 % of it", 9) == ["bias", "1.43 % of", "it"]


def test_a_long_word_is_divided_at_its_hyphen():
    found = wrapped("the loss brightness-independent", 12)
    assert found == ["the loss", "brightness-", "independent"]


def test_names_of_the_command_line_become_those_of_the_list(settings):
    text = with_labels("Hidden:transmission_roughness and Hidden:roughness", settings.rows)
    assert "_" not in text and text.endswith(" and Hidden: Roughness")
