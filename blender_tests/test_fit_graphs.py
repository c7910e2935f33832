# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of the constants of node graphs to photos by Cycles."""

import bpy
import graph_fits
import pytest
from command_line import command

pytestmark = [pytest.mark.blender, pytest.mark.slow]

#: Of a 90 % interval, how many half-widths the truth may be away: one value in 500 is further.
_WIDTHS = 1.9


@pytest.mark.parametrize("name", graph_fits.CASES)
def test_a_fit_finds_the_constants_of_a_graph(name, tmp_path, capsys):
    case = graph_fits.CASES[name]
    if name in {"metallic", "conductor"} and not hasattr(bpy.types, "ShaderNodeBsdfMetallic"):
        pytest.skip("this Blender has no Metallic BSDF")
    scene, words = graph_fits.photographed(case, tmp_path, size=40, samples=512)
    status, report, printed = command(
        capsys, "fit", scene, *words, f"--out={tmp_path / 'out'}", "--preset=draft",
        "--threads=2", "--seed=5",
    )  # fmt: skip
    assert status == 0, printed
    for parameter, truth in case.truth.items():
        row = report["parameters"][f"Body:{parameter}"]
        values, intervals = row["value"], row["interval_90"]
        if len(truth) == 1:
            values, intervals = [row["value"]], [row["interval_90"]]
        for value, true, between in zip(values, truth, intervals, strict=True):
            if parameter.endswith("Rotation"):  # half a turn stretches alike
                value -= 0.5 * round((value - true) / 0.5)
            assert value == pytest.approx(true, rel=0.02), parameter
            if between is None and parameter.endswith("Rotation"):  # two answers: no interval
                continue
            low, high = between
            allowed = _WIDTHS * (high - low) / 2
            assert abs(value - true) <= allowed, (parameter, value, low, high)
