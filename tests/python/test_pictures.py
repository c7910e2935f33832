# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of a fit without Blender: text, curves, comparisons, sheets, alignments."""

from __future__ import annotations

import itertools
import math
import string
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from selenite.capture.prepared import Capture
from selenite.fit import capture_render
from selenite.report.pictures import comparison, glyphs, plots, sheet
from selenite.report.pictures.canvas import Canvas, encoded, heat, resized
from selenite.report.pictures.comparison import Choice, Pictures, compared

RED = (1.0, 0.0, 0.0)


def test_every_character_of_names_has_a_glyph_of_its_own() -> None:
    seen = {}
    for char in string.ascii_letters + string.digits + "+-.,:;_()[]/%#=<>|?!":
        drawn = glyphs.coverage(char, 24)
        assert drawn.max() > 0.9, char
        key = (drawn.shape, drawn.tobytes())
        assert key not in seen, f"{char} looks as {seen[key]}"
        seen[key] = char


def test_accents_are_left_out_and_unknown_characters_marked() -> None:
    assert glyphs.plain("Körper é 中") == "Korper e ?"
    assert not glyphs.coverage("   ", 20).any()


@pytest.mark.parametrize("width", [20.0, 60.0, 200.0])
def test_long_text_is_cut_to_its_width(width: float) -> None:
    text = glyphs.cut("A material with a rather long name", 14, width)
    assert glyphs.width_of(text, 14) <= width
    assert text.endswith("..") and len(text) > 2


def test_lines_pass_through_their_points_and_leave_gaps_open() -> None:
    page = Canvas(60, 40, (1.0, 1.0, 1.0))
    page.line([(5, 5), (25, 35), (math.nan, 0), (35, 5), (55, 35)], RED, 2)
    for x, y in ((5, 5), (15, 20), (25, 34), (35, 5), (45, 20)):
        assert page.pixels[y, x, 1] < 0.3, (x, y)
    assert page.pixels[:, 29:32].min() == 1.0
    flat = Canvas(60, 40, (1.0, 1.0, 1.0))
    flat.line([(10, 20.5), (50, 20.5)], RED, 1)
    across = 1 - flat.pixels[:, 30, 1]
    assert across.sum() == pytest.approx(1, abs=0.1), "a line covers its width"


def test_drawing_outside_of_the_page_changes_nothing() -> None:
    page = Canvas(20, 20)
    before = page.pixels.copy()
    page.line([(-50, -50), (-20, -9)], RED, 3)
    page.text(100, 3, "outside")
    page.text(3, -40, "outside")
    page.fill(30, 0, 40, 20, RED)
    assert (page.pixels == before).all()
    page.text(-4, -4, "MMM", size=18)
    assert (page.pixels != before).any()


def test_colours_of_an_error_rise_in_brightness() -> None:
    ramp = heat(np.linspace(0, 1, 32)).sum(axis=-1)
    assert (np.diff(ramp) > 0).all()
    assert (heat(np.array([-1.0, 2.0])) == heat(np.array([0.0, 1.0]))).all()


@pytest.fixture
def pictures() -> Pictures:
    """40 x 30: a dark photo, a bright render; the two left columns do not count."""
    photo = np.full((30, 40, 3), 0.1, np.float32)
    weight = np.ones((30, 40), np.float32)
    weight[:, :2] = 0
    return Pictures(photo, weight, photo + 0.1, photo + 0.4)


def body(pictures: Pictures, choice: Choice) -> np.ndarray:
    """Of a comparison, in the photo's pixels."""
    return comparison._body(pictures, choice, pictures.weight.shape)[0]


def test_wipe_has_the_photo_on_its_left_and_the_render_on_its_right(pictures: Pictures) -> None:
    both = body(pictures, Choice(comparison.WIPE, 0.25))
    assert both[5, 2:10] == pytest.approx(encoded(pictures.photo)[5, 2:10])
    assert pictures.render is not None
    assert both[5, 10:] == pytest.approx(encoded(pictures.render)[5, 10:])
    wiped = body(pictures, Choice(comparison.BEFORE_AFTER, 0.5))
    assert pictures.start is not None
    assert wiped[5, 2:20] == pytest.approx(encoded(pictures.start)[5, 2:20])


@pytest.mark.parametrize("at", [-1.0, 0.0, 1.0, 3.0])
def test_wipe_line_stays_on_the_picture(pictures: Pictures, at: float) -> None:
    shown = body(pictures, Choice(comparison.WIPE, at))
    whole = pictures.render if at <= 0 else pictures.photo
    assert whole is not None
    assert shown[:, 2:] == pytest.approx(encoded(whole)[:, 2:])


def test_difference_has_a_fixed_scale_and_none_where_the_photo_does_not_count(
    pictures: Pictures,
) -> None:
    for scale in (0.1, 0.2, 0.4):
        shown = body(pictures, Choice(comparison.DIFFERENCE, scale=scale))
        assert shown[5, 5] == pytest.approx(heat(np.array([0.1 / scale]))[0], abs=1e-3)
        red = encoded(np.array(comparison.OUTSIDE, np.float32).reshape(1, 1, 3))[0, 0]
        assert shown[5, 0] == pytest.approx(red)


def test_masked_region_is_marked_in_every_mode(pictures: Pictures) -> None:
    for mode in (comparison.PHOTO, comparison.RENDER, comparison.WIPE, comparison.DIFFERENCE):
        shown = body(pictures, Choice(mode))
        red, green, blue = shown[5, 0]
        assert red > green + 0.15 and red > blue + 0.15, mode


def test_comparison_without_a_render_shows_the_photo(pictures: Pictures) -> None:
    alone = Pictures(pictures.photo, pictures.weight)
    for mode in (comparison.RENDER, comparison.WIPE, comparison.DIFFERENCE):
        assert (body(alone, Choice(mode)) == body(alone, Choice(comparison.PHOTO))).all()


@pytest.mark.parametrize("rows", [3, 30, 319, 1000])
def test_small_pictures_are_enlarged_and_large_ones_reduced(rows: int) -> None:
    photo = np.full((rows, rows * 2, 3), 0.2, np.float32)
    page = compared(Pictures(photo, np.ones(photo.shape[:2], np.float32)), Choice(), "Front")
    assert 320 <= page.shape[0] <= 800
    assert np.isfinite(page).all()


def test_render_of_another_size_is_brought_to_the_photo(pictures: Pictures) -> None:
    small = Pictures(pictures.photo, pictures.weight, np.full((15, 20, 3), 0.2, np.float32))
    shown = body(small, Choice(comparison.DIFFERENCE, scale=0.2))
    assert shown[5, 5] == pytest.approx(heat(np.array([0.5]))[0], abs=1e-3)


def test_reduced_errors_are_means_over_what_counts() -> None:
    error = np.full((4, 4), np.nan, np.float32)
    error[:2, :2] = [[1, 2], [3, 4]]
    error[2, 0] = 5
    small = resized(error, 2, 2)
    assert small[0, 0] == pytest.approx(2.5) and small[1, 0] == pytest.approx(5)
    assert np.isnan(small[:, 1]).all()


def test_sheet_shows_every_photo_and_stays_readable_for_forty() -> None:
    photo = np.full((60, 90, 3), 0.2, np.float32)
    tiles = sheet.small(photo, np.ones((60, 90), np.float32), photo * 0.5, photo)
    one = sheet.of_fit({"A": tiles}, 0.2).pixels.shape
    forty = sheet.of_fit({f"A{n}": tiles for n in range(40)}, 0.2).pixels.shape
    assert one[0] > 220 and forty[0] < 40 * 220
    assert list(tiles) == ["photo", "start", "fit", "|start - photo|", "|fit - photo|"]
    assert tiles["|start - photo|"][0, 0] == pytest.approx(0.1)
    fitted = sheet.of_fit({"A": tiles}, 0.2, 570).pixels.shape
    assert fitted[1] <= 570 < one[1], "an editor shows it in its own pixels, so words stay readable"


@pytest.mark.parametrize(
    ("low", "high"), [(0, 1), (-0.3, 0.7), (0.299, 0.3021), (0, 10000), (1e-9, 3e-9)]
)
@pytest.mark.parametrize("most", [2, 4])
def test_ticks_are_round_and_inside(low: float, high: float, most: int) -> None:
    found = plots.ticks(low, high, most)
    assert 2 <= len(found) <= 6
    assert all(low - 1e-9 * (high - low) <= value <= high * (1 + 1e-9) for value in found)
    steps = np.diff(found)
    assert steps == pytest.approx(np.full(len(steps), steps[0]))
    mantissa = steps[0] / 10 ** math.floor(math.log10(steps[0]) + 1e-9)
    assert any(mantissa == pytest.approx(round_number) for round_number in (1, 2, 5, 10))


@pytest.mark.parametrize(("low", "high"), [(1e-4, 1), (0.02, 0.031), (1e-12, 1e9), (3, 700)])
def test_logarithmic_axes_have_at_least_two_ticks(low: float, high: float) -> None:
    found = plots.decades(low, high)
    assert 2 <= len(found) <= 9
    assert all(0.99 * low <= value <= 1.01 * high for value in found)


def fitted(**more: object) -> tuple[SimpleNamespace, dict[str, object]]:
    """A plan and a history with a number, a colour and gaps in the validated loss."""

    def unknown(name: str, label: str, low: float, high: float) -> SimpleNamespace:
        parameter = SimpleNamespace(label=label, unit="1", name=name)
        return SimpleNamespace(
            name=f"Body:{name}", owner="Body", parameter=parameter, minimum=low, maximum=high,
            by_ratio=False,
        )  # fmt: skip

    unknowns = [unknown("roughness", "Roughness", 0, 1), unknown("base_color", "Base Color", 0, 1)]
    history = {
        "iteration": np.arange(6),
        "loss": np.linspace(1, 0.1, 6),
        "validation": np.array([0.9, math.nan, math.nan, 0.3, math.nan, 0.1]),
        "values": {
            "Body:roughness": np.linspace(0.5, 0.2, 6)[:, None],
            "Body:base_color": np.tile([0.1, 0.5, 0.9], (6, 1)),
        },
        "field_means": {},
    }
    return SimpleNamespace(unknowns=unknowns, fields=[]), history | more


def test_plots_show_the_loss_and_each_parameter_with_its_bounds_and_interval() -> None:
    plan, history = fitted()
    report = {"Body:roughness": {"interval_90": [[0.18, 0.22]]}}
    result = {"best_iteration": 4, "report": {"parameters": report}}
    loss, roughness, colour = plots.of_fit(plan, history, result)  # type: ignore[arg-type]
    assert [len(item.curves) for item in (loss, roughness, colour)] == [2, 1, 3]
    assert loss.logarithmic and loss.mark == 4
    assert roughness.bounds == (0, 1)
    assert [item[:2] for item in roughness.intervals] == [(0.18, 0.22)]
    page = plots.page([loss, roughness, colour]).pixels
    assert page.shape == (2 * 210 + 4, 800, 3) and np.isfinite(page).all()
    # From upper left to lower right, in the blue of a number: the second plot of the first row.
    blue = np.argwhere(np.abs(page[:210, 400:] - plots._BLUE).sum(axis=-1) < 0.2)
    first, last = blue[blue[:, 1].argmin()], blue[blue[:, 1] < 380][-1]
    assert first[0] < last[0]


@pytest.mark.parametrize("width", [200, 260, 400])
@pytest.mark.parametrize("title", ["Base Color", "Subsurface Radius of a Wax Candle"])
def test_labels_of_a_plot_do_not_overlap(
    width: int, title: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes = []
    draw = Canvas.text

    def text(self: Canvas, x: float, y: float, words: str, **options: Any) -> None:
        size = options.get("size", 14)
        wide = glyphs.width_of(glyphs.cut(words, size, options.get("width", np.inf)), size)
        if y < 10 and words:
            left = x - options.get("align", 0) * wide
            boxes.append((left, left + wide, words))
        draw(self, x, y, words, **options)

    monkeypatch.setattr(Canvas, "text", text)
    values = np.linspace(0.2, 0.8, 9).reshape(3, 3)
    plot = plots.Plot(title, np.arange(3.0), plots._channels(values), bounds=(0.0, 1.0))
    plots.page([plot], (width, 160))
    boxes.sort()
    assert len(boxes) >= 4 and boxes[0][2] == title
    assert all(a[1] <= b[0] + 1 for a, b in itertools.pairwise(boxes)), boxes


def test_plots_of_a_fit_that_has_barely_begun_draw() -> None:
    plan, history = fitted(
        iteration=np.arange(1), loss=np.array([math.nan]), validation=np.array([math.nan]),
        values={"Body:roughness": np.array([[0.5]]), "Body:base_color": np.zeros((1, 3))},
    )  # fmt: skip
    assert np.isfinite(plots.page(plots.of_fit(plan, history)).pixels).all()  # type: ignore[arg-type]


def test_stages_are_marked_where_they_begin() -> None:
    plan, history = fitted(stage=np.array([1, 1, 1, 2, 2, 2]))
    assert plots.of_fit(plan, history)[0].stages == [3.0]  # type: ignore[arg-type]


def test_many_parameters_are_cut_and_counted() -> None:
    plan, history = fitted()
    (loss, *_) = plots.of_fit(plan, history)  # type: ignore[arg-type]
    assert plots.page([loss] * 60).pixels.shape[0] == plots.page([loss] * 24).pixels.shape[0] + 20


def capture(**more: object) -> Capture:
    """A photo of 800 x 600, compared at 80 x 60."""
    values = {
        "id": "Front", "camera": "Front", "photo": "front.png", "photo_size": (800, 600),
        "reference": np.zeros((60, 80, 3), np.float32), "weight": np.ones((60, 80), np.float32),
        "aspect": 4 / 3,
    }  # fmt: skip
    return Capture(**(values | more))  # type: ignore[arg-type]


def test_alignment_in_the_file_is_that_of_the_fit() -> None:
    found = {"captures": {"Front": {"shift": (1.5, -0.25, 0.01)}}}
    assert capture_render.alignment_of(capture(), found) == (1.5, -0.25, 0.01)
    stored = {"captures": {"Front": {"shift": [15.0, -2.5, math.degrees(0.01)]}}}
    assert capture_render.alignment_in_file(capture(), stored) == pytest.approx((1.5, -0.25, 0.01))
    for nothing in (None, {}, {"captures": {}}, {"captures": {"Front": {}}}):
        assert capture_render.alignment_of(capture(), nothing) == (0, 0, 0)
        assert capture_render.alignment_in_file(capture(), nothing) == (0, 0, 0)


def test_alignment_of_a_lower_stage_counts_in_its_pixels() -> None:
    found = {"captures": {"Front": {"shift": (1.0, 2.0, 0.01)}}, "stages": [{"height": 30}]}
    assert capture_render.alignment_of(capture(), found) == (2.0, 4.0, 0.01)


@pytest.mark.parametrize("shift", [[1.0, 2.0], "no", [1.0, 2.0, None], [1.0, 2.0, math.inf]])
def test_shift_that_is_none_is_refused(shift: object) -> None:
    with pytest.raises(ValueError, match="Front.*two pixels and an angle"):
        capture_render.alignment_in_file(capture(), {"captures": {"Front": {"shift": shift}}})


@pytest.mark.parametrize("room", [(500, 300), (900, 900), (300, 120), (2000, 400)])
@pytest.mark.parametrize("count", [1, 3, 7])
def test_plots_fill_their_room(room: tuple[int, int], count: int) -> None:
    plan, history = fitted()
    (loss, *_) = plots.of_fit(plan, history)  # type: ignore[arg-type]
    rows, columns = plots.page([loss] * count, room).pixels.shape[:2]
    if (room[0] // 200) * (room[1] // 120) >= count:  # else there is no room for readable ones
        assert columns <= room[0] and rows <= room[1]
        assert columns * rows > 0.5 * room[0] * room[1]
    assert columns >= 200 and rows >= 96, "they stay readable"


@pytest.mark.parametrize("room", [(500, 300), (900, 900), (640, 200)])
@pytest.mark.parametrize("rows", [20, 96, 1000])
def test_comparison_fits_its_room(room: tuple[int, int], rows: int) -> None:
    photo = np.full((rows, rows * 4 // 3, 3), 0.2, np.float32)
    taken = Pictures(photo, np.ones(photo.shape[:2], np.float32))
    height, width = compared(taken, Choice(), "Front", room).shape[:2]
    assert height <= room[1] and width <= room[0]
    assert height > 0.8 * min(room[1], room[0] * 3 / 4), "and fills it"
