# SPDX-License-Identifier: GPL-3.0-or-later
"""1 / extinction in millimetres of the scene's unit: in `check`, in result.json, in the lines."""

import bpy
import made_scenes as made
import pytest
from command_line import command

from selenite import mean_free_path

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def filled(kind, color=(0.5, 0.5, 0.5)):
    """The studio with a volume node of density 4; its extinction where it is an Absorption is
    4 (1 - color), in a Principled Volume 4."""
    material = made.studio(transmission=1.0)
    tree = material.node_tree
    node = tree.nodes.new(kind)
    node.inputs["Density"].default_value = 4.0
    node.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])


@pytest.mark.parametrize(
    ("extinction", "millimetres", "value", "unit", "text"),
    [
        ((2.0, 2.0, 2.0), 1000.0, (500, 500, 500), "mm", "500 mm"),
        ((0.0, 2.0, 8.0), 10.0, (None, 5, 1.25), "mm", "endless, 5, 1.25 mm"),
        ((0.0, 0.0, 0.0), 1.0, (None, None, None), "mm", "endless"),
        ((4.0, 4.0, 4.0), None, (0.25,) * 3, "Blender unit", "0.25 Blender unit"),
        ((1e8, 1e8, 1e8), 1000.0, (1e-5,) * 3, "mm", "1e-05 mm"),
    ],
)
def test_lengths(extinction, millimetres, value, unit, text):
    found = mean_free_path.of(extinction, millimetres)
    assert found.value == pytest.approx(value) and found.unit == unit
    assert found.text() == text
    assert found.as_json() == {"value": list(found.value), "unit": unit}


@pytest.mark.parametrize(
    ("system", "scale", "value", "unit"),
    [
        ("METRIC", 1.0, [None, 500, 250], "mm"),
        ("METRIC", 0.01, [None, 5, 2.5], "mm"),
        ("IMPERIAL", 0.3048, [None, 152.4, 76.2], "mm"),
        ("NONE", 0.01, [None, 0.5, 0.25], "Blender unit"),
    ],
)
def test_check_tells_it_in_the_units_of_the_scene(system, scale, value, unit, tmp_path, capsys):
    filled("ShaderNodeVolumeAbsorption", (1.0, 0.5, 0.0))
    bpy.context.scene.unit_settings.system = system
    bpy.context.scene.unit_settings.scale_length = scale
    status, report, printed = command(capsys, "check", made.save(tmp_path / "scene.blend"))
    assert status == 0, printed
    row = report["owners"]["Body"]["parameters"]["extinction"]
    assert row["value"] == pytest.approx([0, 2, 4])  # Cycles ignores the unit scale
    assert row["unit"] == "1/Blender unit"
    assert row["mean_free_path"]["value"] == [
        None if item is None else pytest.approx(item, rel=1e-6) for item in value
    ]
    assert row["mean_free_path"]["unit"] == unit
    assert (
        f"mean free path in the medium: endless, {value[1]:.3g}, {value[2]:.3g} {unit}" in printed
    )


def test_a_scene_without_a_medium_says_nothing_of_it(tmp_path, capsys):
    made.studio()
    status, report, printed = command(capsys, "check", made.save(tmp_path / "scene.blend"))
    assert status == 0, printed
    assert "mean_free_path" not in report["owners"]["Body"]["parameters"]["extinction"]
    assert "mean free path" not in printed


def test_result_of_a_fit_holds_both_lengths(tmp_path, capsys):
    filled("ShaderNodeVolumePrincipled")
    bpy.context.scene.unit_settings.scale_length = 0.1
    photo = made.photo(tmp_path / "Camera.png", value=0.3)
    status, report, printed = command(
        capsys, "fit", made.save(tmp_path / "scene.blend"), f"--photo=Camera={photo}",
        "--fit=Body:extinction,albedo", "--start=Body:extinction=5", "--iterations=2", "--spp=2",
        "--height=8", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    assert status == 0, printed
    rows = report["parameters"]
    path = rows["Body:extinction"]["mean_free_path"]
    assert path["initial"] == pytest.approx([20, 20, 20]) and path["unit"] == "mm"
    wanted = [100 / sigma for sigma in rows["Body:extinction"]["value"]]
    assert path["value"] == pytest.approx(wanted)
    assert "mean_free_path" not in rows["Body:albedo"]
    assert "  mean free path" in printed and " mm" in printed
