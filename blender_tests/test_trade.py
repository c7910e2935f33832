# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite trade`: table, plot and front on a scene of known values. Seconds are those of a made
clock, so that what fits into a budget does not depend on the machine."""

import builtins
import csv
import json
import math
import time
from dataclasses import replace
from types import SimpleNamespace

import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.advice.trade import choices, measure, report
from selenite.fit.settings import PRESETS, FitSettings
from selenite.fit.unknowns import Unknown
from selenite.parameters import table

pytestmark = pytest.mark.blender

#: Seconds of a path by the made clock. The real ones are far below: no fit is given up as too slow.
PER_PATH = 1e-3


class Clock:
    """In place of the module `time`; fits move it on by what they are expected to take."""

    now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        time.sleep(seconds)


@pytest.fixture(autouse=True)
def clock(monkeypatch):
    made_clock = Clock()

    class Timed(measure.FitJob):
        def join(self):
            super().join()
            settings = self.plan.request.settings
            made_clock.now += measure.cost.expected(self.plan, settings, PER_PATH)

    monkeypatch.setattr(measure, "time", made_clock)
    monkeypatch.setattr(measure.cost, "seconds_per_path", lambda *_: PER_PATH)
    monkeypatch.setattr(measure, "FitJob", Timed)
    return made_clock


def expected_seconds(lit_ball, capsys):
    """Of each setting, cheapest first: from a measurement whose budget none of them fits into."""
    words = ("--fit=Body:base_color", "--fit=Key Light:power", "--budget=1e-3")
    _, content, _ = command(capsys, "trade", lit_ball, *words, f"--out={lit_ball}-expected")
    return sorted(row["expected_seconds"] for row in content["settings"])


def test_it_measures_within_its_budget_and_writes_table_and_plot(lit_ball, tmp_path, capsys):
    out = tmp_path / "out"
    budget = 1.01 * sum(expected_seconds(lit_ball, capsys)[:4])
    fitted = ("--fit=Body:base_color", "--fit=Key Light:power")
    words = (*fitted, f"--budget={budget}", f"--out={out}")
    status, content, printed = command(capsys, "trade", lit_ball, *words)
    assert status == 0, printed
    assert content["seconds"] <= budget
    stored = json.loads((out / "trade.json").read_text(encoding="utf-8"))
    assert stored == {key: content[key] for key in stored}
    with (out / "trade.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert [line["name"] for line in lines] == [row["name"] for row in content["settings"]]
    assert tuple(lines[0]) == report.COLUMNS
    measured = [row for row in content["settings"] if row["runs"]]
    assert len(measured) >= 3
    used = sum(row["runs"] * row["expected_seconds"] for row in measured)
    assert used == pytest.approx(content["seconds"])
    left = [row["expected_seconds"] for row in content["settings"] if not row["runs"]]
    assert min(left) > budget - used  # what was left out did not fit any more
    assert set(content["presets"]) == set(PRESETS)
    assert {row["height"] for row in content["settings"]} == {24}  # no more than is rendered
    for row in measured:
        assert row["lowest_error"] <= row["error"] <= row["highest_error"]
        assert row["seconds"] > 0 and row["error"] < 0.2  # of a start 0.3 and a factor of 2 away
    on_front = [(row["seconds"], row["error"]) for row in measured if row["on_front"]]
    assert on_front
    for row in measured:
        beaten = any(s <= row["seconds"] and e <= row["error"] for s, e in on_front)
        assert beaten
    power = content["parameters"]["Key Light:power"]
    assert power["true"] == pytest.approx([200]) and power["start"] == pytest.approx([100])
    picture = native.image().read(str(out / "trade.png"))[0]
    assert picture.shape[0] > 400 and np.ptp(picture) > 0.5
    assert "front" in printed


def test_a_budget_that_nothing_fits_into_leaves_a_table_and_says_so(lit_ball, tmp_path, capsys):
    out = tmp_path / "out"
    words = ("--fit=Body:base_color", "--budget=1e-3", f"--out={out}")
    status, content, printed = command(capsys, "trade", lit_ball, *words)
    assert status == 0, printed
    assert not any(row["runs"] for row in content["settings"])
    assert content["files"]["plot"] is None
    assert "no fit ended within the budget" in printed and "raise --budget" in printed
    assert sorted(item.name for item in out.iterdir()) == ["trade.csv", "trade.json"]


def row_of(name, seconds, errors):
    return report.SettingsRow(
        name=name, preset="", height=24, spp=4, depth=0, iterations=5, runs=len(errors),
        expected_seconds=1.0, seconds=seconds, cpu_seconds=seconds,
        error=sum(errors) / len(errors), lowest_error=min(errors), highest_error=max(errors),
        on_front=True, errors={}, failure=None,
    )  # fmt: skip


@pytest.mark.parametrize(
    "errors",
    [
        [[0.1], [0.01]],
        [[0.0], [0.0]],  # has no logarithm
        [[0.0], [0.1]],
        [[0.1 + 0.2, 0.3], [0.3]],
    ],
)
def test_any_errors_can_be_plotted(errors):
    rows = [row_of(f"{i}", 1.0 + i, found) for i, found in enumerate(errors)]
    # as rounding may have it
    rows[0] = replace(rows[0], error=rows[0].lowest_error * (1 - 1e-16))
    request = SimpleNamespace(scene="/a/$x$^ \udce9.blend")
    trade = SimpleNamespace(plan=SimpleNamespace(request=request))
    assert report.plot(report.TradeReport(trade, rows)).startswith(b"\x89PNG")
    assert report.plot(report.TradeReport(trade, [])) is None


def test_without_matplotlib_there_is_a_table_and_a_word(lit_ball, tmp_path, capsys, monkeypatch):
    plain = builtins.__import__

    def without(name, *rest, **more):
        if name.startswith("matplotlib"):
            raise ImportError(name)
        return plain(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    words = ("--fit=Body:base_color", "--budget=2000", f"--out={tmp_path / 'out'}")
    status, content, printed = command(capsys, "trade", lit_ball, *words)
    assert status == 0, printed
    assert content["files"]["plot"] is None
    assert "matplotlib is not installed" in printed
    assert sorted(item.name for item in (tmp_path / "out").iterdir()) == ["trade.csv", "trade.json"]


def test_cameras_of_photos_count_and_nothing_else_of_them(lit_ball, tmp_path, capsys):
    photo = made.photo(tmp_path / "grey.png", size=(16, 12))
    words = ("--fit=Body:base_color", "--budget=700", f"--photo=Camera={photo}")
    out = f"--out={tmp_path / 'out'}"
    status, content, _ = command(capsys, "trade", lit_ball, *words, out)
    assert status == 0
    assert {row["height"] for row in content["settings"]} == {12}
    assert min(row["error"] for row in content["settings"] if row["runs"]) < 0.1


def test_a_fit_that_fails_is_told_and_the_others_go_on(lit_ball, tmp_path, capsys, monkeypatch):
    from selenite.fit.job import FitFailed
    from selenite.problems import Problem

    class Fragile(measure.FitJob):
        def progress(self):
            if self.plan.request.settings.iterations == PRESETS["draft"].iterations:
                raise FitFailed([Problem("Iteration 2", "it is not finite", "fit less")])
            return super().progress()

    monkeypatch.setattr(measure, "FitJob", Fragile)
    words = ("--fit=Body:base_color", "--budget=4000", f"--out={tmp_path / 'out'}")
    status, content, printed = command(capsys, "trade", lit_ball, *words)
    assert status == 0
    assert content["presets"]["draft"]["failure"] == "Iteration 2: it is not finite; fit less"
    assert "'draft' came to no end" in printed
    assert any(row["runs"] for row in content["settings"])


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--budget=0",), "Argument --budget"),
        (("--budget=nan",), "Argument --budget"),
        (("--fit=Body:rough",), "no parameter 'rough'"),
        (("--loss=l2",), "'l2' is not known"),
        (("--photo=Other=nowhere.png",), "Camera 'Other'"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(lit_ball, tmp_path, capsys, words, text):
    out = tmp_path / "out"
    base = () if words[0].startswith("--fit") else ("--fit=Body:base_color",)
    status, content, _ = command(capsys, "trade", lit_ball, *base, *words, f"--out={out}")
    assert status == 2
    assert any(text in f"{p['object']}: {p['cause']}" for p in content["problems"]), content
    assert not out.exists()


def unknown(kind, name, start, low, high):
    return Unknown("Owner", table()[kind, name], start, low, high, 0.03)


def test_starts_lie_away_from_the_truth_and_inside_the_bounds():
    colour = unknown("material", "base_color", (0.1, 0.5, 0.999), 0.001, 0.999)
    moved = choices.displaced(colour)
    assert moved == pytest.approx((0.1 + 0.2994, 0.5 + 0.2994, 0.999 - 0.2994))
    power = unknown("light", "power", (9000.0,), 0.001, 10000.0)
    assert choices.displaced(power) == pytest.approx((4500.0,))
    narrow = unknown("material", "ior", (1.45,), 1.4, 1.5)
    assert 1.4 < choices.displaced(narrow)[0] < 1.5


def test_errors_are_differences_or_logarithms_of_ratios():
    colour = unknown("material", "base_color", (0.1, 0.5, 0.7), 0.001, 0.999)
    assert choices.error_of(colour, (0.1, 0.5, 0.7)) == 0
    assert choices.error_of(colour, (0.2, 0.6, 0.6)) == pytest.approx(0.1)
    power = unknown("light", "power", (50.0,), 0.001, 10000.0)
    assert choices.error_of(power, (100.0,)) == pytest.approx(math.log(2))
    errors = {colour.name: 0.3, power.name: 0.4}
    assert choices.total([colour, power], errors) == pytest.approx(math.sqrt(0.125))


def test_the_front_holds_what_nothing_beats():
    points = [(1.0, 0.5), (2.0, 0.1), (3.0, 0.2), (4.0, 0.05), (1.0, 0.6)]
    assert choices.front(points) == [True, True, False, True, False]
    assert choices.front([]) == []


def test_settings_are_distinct_and_keep_what_no_preset_sets():
    found = choices.choices(FitSettings(loss="mse", seed=7, threads=1), 256)
    assert [item.preset for item in found][:3] == list(PRESETS)
    assert len({item.settings for item in found}) == len(found) >= 9
    kept = {(item.settings.loss, item.settings.seed, item.settings.threads) for item in found}
    assert kept == {("mse", 7, 1)}
    assert {item.settings.depth for item in found} == {0, 4, 8}
    small = choices.choices(FitSettings(), 20)
    assert {item.settings.height for item in small} == {20}
    assert len({item.settings for item in small[3:]}) == len(small) - 3


@pytest.mark.usefixtures("addon")
def test_the_panel_measures_the_ticked_parameters(tmp_path):
    import bpy
    from test_interface import draw, prepare_fit

    from selenite.interface import panels, state

    _, settings = prepare_fit(tmp_path)
    settings.trade_budget, settings.output = 3000.0, str(tmp_path / "fits")
    assert "selenite.trade" in draw(panels.SELENITE_PT_advanced)
    assert bpy.ops.selenite.trade() == {"FINISHED"}
    (folder,) = (tmp_path / "fits").iterdir()
    assert {"trade.csv", "trade.json"} <= {item.name for item in folder.iterdir()}
    drawn = draw(panels.SELENITE_PT_advanced)
    assert "Draft: " in drawn and "error" in drawn
    assert state.TRADE.job is None
    for row in settings.rows:
        row.enabled = False
    with pytest.raises(RuntimeError, match="no parameter is ticked"):
        bpy.ops.selenite.trade()
