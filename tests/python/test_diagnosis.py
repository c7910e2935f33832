# SPDX-License-Identifier: GPL-3.0-or-later
"""Each pathology, scripted, gives its sentence and no other; a healthy fit gives none."""

import re
from dataclasses import replace

import numpy as np
import pytest

from selenite._core import StopReason
from selenite.fit.diagnosis import course as diagnosis
from selenite.fit.diagnosis.course import Limits, View, diagnose

ROUGHNESS = Limits("Body:roughness", 0.02, 0.999)
COLOUR = Limits("Body:base_color", 0.001, 0.999)
EXTINCTION = Limits("Jade:extinction", 0.001, 1000.0, logarithmic=True)


def history(values, validation=None, error=1e-5):
    """A history with a validation in every fifth row; values: {name: (k,) or (k, 3)}."""
    rows = len(next(iter(values.values())))
    losses = np.full(rows, np.nan)
    falling = 0.01 * 0.5 ** np.arange(rows)
    losses[::5] = (falling if validation is None else np.asarray(validation))[::5]
    return {
        "iteration": np.arange(rows),
        "validation": losses,
        "validation_standard_error": np.full(rows, error),
        "values": {name: np.asarray(value, float) for name, value in values.items()},
    }


def ball(size=48, radius=15.0, shift=(0.0, 0.0)):
    """A shaded ball over a dim background, (size, size, 3), and where the ball is."""
    y, x = np.mgrid[:size, :size] - size / 2 + 0.5
    x, y = x - shift[0], y - shift[1]
    inside = np.clip(radius - np.hypot(x, y) + 0.5, 0, 1)
    shade = 0.3 + 0.5 * np.clip(1 + (x - y) / (2 * radius), 0, 2)
    picture = 0.1 + inside * (shade - 0.1)
    return np.repeat(picture[..., None], 3, axis=2).astype(np.float32), inside >= 1


def view(photo, picture, weight=None):
    rng = np.random.default_rng(1)
    noisy = picture * (1 + 0.02 * rng.standard_normal(picture.shape))
    weight = np.ones(photo.shape[:2]) if weight is None else weight
    return View("Front", photo, weight.astype(np.float32), noisy.astype(np.float32))


def converged(rows=30, end=0.3):
    """Values that come to rest inside the bounds, with a little noise."""
    rng = np.random.default_rng(2)
    return end + 0.3 * 0.6 ** np.arange(rows) + 0.001 * rng.standard_normal(rows)


def test_a_healthy_fit_gives_no_sentence():
    picture, _ = ball()
    three = np.stack([converged(end=e) for e in (0.2, 0.5, 0.6)], axis=1)
    seen = history({"Body:roughness": converged(), "Body:base_color": three})
    assert diagnose(seen, [ROUGHNESS, COLOUR], [view(picture, picture)]) == ()
    for rows in (0, 1, 3):
        assert diagnose(history({"Body:roughness": [0.5] * rows}), [ROUGHNESS], []) == ()


@pytest.mark.parametrize(
    ("limits", "values", "words"),
    [
        (ROUGHNESS, [0.5, 0.2, *[0.02] * 6], "Body:roughness has sat at its minimum 0.02 for 6"),
        (COLOUR, [[0.1, 0.2, 0.3]] + [[0.1, 0.2, 0.999]] * 7, "Body:base_color.b has sat at its m"),
        (COLOUR, [[0.1, 0.2, 0.3]] + [[0.001, 0.2, 0.001]] * 7, "Body:base_color (r, b) has sat"),
        (EXTINCTION, [40.0, 400.0, *[1000.0] * 9], "maximum 1000 for 9 iterations"),
    ],
)
def test_a_value_that_sits_at_its_bound(limits, values, words):
    (note,) = diagnose(history({limits.name: values}), [limits], [])
    assert words in note and "widen the bound" in note


def test_a_bound_where_the_range_ends_cannot_be_widened():
    limits = Limits("Body:transmission", 0, 1, range_ends=frozenset({"maximum"}))
    (note,) = diagnose(history({limits.name: [0.5, *[1.0] * 7]}), [limits], [])
    assert "has sat at its maximum 1" in note and "widen" not in note


def test_a_small_extinction_is_not_at_its_bound():
    assert not diagnose(history({EXTINCTION.name: [0.5] * 9}), [EXTINCTION], [])


def test_a_value_on_its_way_to_a_bound():
    even = 0.55 + 0.03 * np.arange(12)
    (note,) = diagnose(history({"Body:roughness": even}), [ROUGHNESS], [])
    assert not diagnose(history({"Body:roughness": even - 0.1}), [ROUGHNESS], [])  # far from it
    assert "Body:roughness = 0.88 has moved towards its maximum 0.999 for 8 iterations" in note
    slowing = 0.95 - 0.6 * 0.6 ** np.arange(12)
    assert not diagnose(history({"Body:roughness": slowing}), [ROUGHNESS], [])
    grows = 9.0 * 1.3 ** np.arange(15)
    (note,) = diagnose(history({"Jade:extinction": grows}), [EXTINCTION], [])
    assert "towards its maximum 1000" in note


def test_a_loss_that_does_not_fall():
    losses = np.linspace(0.0200, 0.0195, 20)
    seen = history({"Body:roughness": converged(20)}, losses)
    (note,) = diagnose(seen, [ROUGHNESS], [])
    assert "has not fallen in 15 iterations (0.02 at first, 0.0196 now)" in note
    assert not diagnose(seen, [ROUGHNESS], [], from_start=False)
    assert not diagnose(seen, [ROUGHNESS], [], explained=True), "noise of the photos"
    assert not diagnose(
        history({"Body:roughness": converged(20)}, losses, error=0.01), [ROUGHNESS], []
    )


def test_a_photo_of_another_exposure():
    picture, _ = ball()
    seen = history({"Body:roughness": converged()})
    (note,) = diagnose(seen, [ROUGHNESS], [view(2 * picture, picture)])
    assert "'Front' is 2.00 times as bright as the render" in note
    assert "brightness-independent-mse" in note
    warm = picture * np.float32([1.6, 1.2, 0.9])
    (note,) = diagnose(seen, [ROUGHNESS], [view(warm, picture)])
    assert "1.60, 1.20, 0.90 times the render in red, green, blue" in note
    assert not diagnose(
        history({"Body:roughness": converged(5)}), [ROUGHNESS], [view(warm, picture)]
    )


@pytest.mark.parametrize("shift", [(1.5, 0.0), (-1.0, 2.0)])
def test_a_photo_that_is_shifted(shift):
    picture, _ = ball()
    photo, _ = ball(shift=shift)
    (note,) = diagnose(
        history({"Body:roughness": converged()}), [ROUGHNESS], [view(photo, picture)]
    )
    found = re.search(r"about ([\d.]+) pixels to the (\w+) and ([\d.]+) (\w+) of its render", note)
    assert found, note
    assert float(found[1]) == pytest.approx(abs(shift[0]), abs=0.4)
    assert float(found[3]) == pytest.approx(abs(shift[1]), abs=0.4)
    assert found[2] == ("right" if shift[0] > 0 else "left")
    assert not shift[1] or found[4] == "down"
    cure = "correct the camera, align the photo (Align, --align), or mask the rim"
    assert note.endswith(f"the silhouette does not fit; {cure}")
    seen = history({"Body:roughness": converged()})
    for end in ({"running": True}, {"explained": True}):
        shifted = [view(photo, picture)]
        assert not diagnose(seen, [ROUGHNESS], shifted, transmits=True, **end)
        assert len(diagnose(seen, [ROUGHNESS], shifted, **end)) == 1
    (through,) = diagnosis.misaligned([view(photo, picture)], transmits=True)
    assert "or what is seen through the body is not right yet" in through
    assert through.endswith(f"if the outlines differ, {cure}")


def test_many_photos_that_are_shifted_are_told_in_one_sentence():
    picture, _ = ball()
    photo, _ = ball(shift=(1.5, 0.0))
    views = [replace(view(photo, picture), id=f"p{number}") for number in range(5)]
    assert len(diagnosis.misaligned(views[:3])) == 3
    (note,) = diagnosis.misaligned([*views, view(picture, picture)])
    assert note.startswith("5 of 6 photos, such as 'p0', 'p1', 'p2', lie beside their render")
    assert "--align" in note


def test_a_mask_that_is_larger_than_the_rendered_ball():
    photo, inside = ball(radius=17.0)
    picture, _ = ball(radius=15.0)
    (note,) = diagnose(
        history({"Body:roughness": converged()}), [ROUGHNESS], [view(photo, picture, inside)]
    )
    share = re.match(r"(\d+)% of the difference of photo 'Front' lies within 3 pixels", note)
    assert share and int(share[1]) > 60, note
    assert "silhouette does not fit" in note


def test_a_rim_whose_photo_is_explained_is_not_told():
    """What noise leaves lies where the picture is brightest, and the blur of edges at the rim."""
    photo, inside = ball(radius=17.0)
    picture, _ = ball(radius=15.0)
    seen = history({"Body:roughness": converged()}), [ROUGHNESS], [view(photo, picture, inside)]
    assert not diagnose(*seen, explained=True)


def test_steps_that_are_noise():
    rng = np.random.default_rng(3)
    jumping = 0.5 + 0.05 * rng.choice([-1, 1], 30)
    (note,) = diagnose(history({"Body:roughness": jumping}), [ROUGHNESS], [])
    converging = 0.5 + (jumping - 0.5) * 0.9 ** np.arange(30)
    assert not diagnose(history({"Body:roughness": converging}), [ROUGHNESS], [])
    assert not diagnose(history({"Body:roughness": jumping[:15]}), [ROUGHNESS], [])
    size = re.search(r"Body:roughness goes back and forth by ([\d.]+) a step", note)
    assert size and 0.03 < float(size[1]) < 0.11, note
    assert "four times the samples" in note


def test_a_loss_that_is_lost_in_noise():
    picture, _ = ball()
    losses = 1e-4 + 1e-5 * np.sin(np.arange(20))
    seen = history({"Body:roughness": converged(20)}, losses, error=8e-4)
    (note,) = diagnose(seen, [ROUGHNESS], [view(picture, picture)])
    assert note.startswith("Noise hides the loss: 0.0001 at first") and "0.0008 only" in note
    quiet = history({"Body:roughness": converged(20)}, losses * 1e-4, error=8e-8)
    assert not diagnose(quiet, [ROUGHNESS], [view(picture, picture)])
    assert not diagnose(seen, [ROUGHNESS], [view(picture, picture)], sure=True), "nothing is hidden"
    assert not diagnose(seen, [ROUGHNESS], [view(picture, picture)], running=True), "not yet"


def test_black_and_wholly_masked_pictures_say_nothing():
    dark = np.zeros((8, 8, 3), np.float32)
    for weight in (np.ones((8, 8)), np.zeros((8, 8))):
        views = [View("Front", dark, weight.astype(np.float32), dark)]
        assert not diagnosis.exposure(views) and not diagnosis.misaligned(views)


@pytest.mark.parametrize(
    ("losses", "falls"),
    [
        (0.01 * 0.9 ** np.arange(41), True),
        (0.01 + 0.1 * 0.7 ** np.arange(41), False),  # at a floor
        (0.0101 - 1e-5 * np.arange(41), False),  # by one percent
        (0.01 * 0.5 ** np.arange(41), False),  # next to nothing is left
    ],
)
def test_a_loss_that_still_falls_when_the_iterations_end(losses, falls):
    seen = history({"Body:roughness": converged(41)}, losses, error=1e-6)
    result = {"history": seen, "stopped": StopReason.ITERATIONS}
    reported = diagnosis.still_falling(result)
    assert len(reported) == falls
    if falls:
        assert "at iteration 25" in reported[0] and "at 35" in reported[0]
        assert "Iterations, such as 80" in reported[0]
    assert not diagnosis.still_falling(result | {"stopped": StopReason.CONVERGED})


def test_noise_and_a_refinement_that_explains_the_photos_silence_a_falling_loss():
    seen = history({"Body:roughness": converged(41)}, 0.01 * 0.97 ** np.arange(41), error=1e-6)
    result = {"history": seen, "stopped": StopReason.ITERATIONS}
    assert diagnosis.still_falling(result)
    noisy = result | {"history": seen | {"validation_standard_error": np.full(41, 0.001)}}
    assert not diagnosis.still_falling(noisy)
    misfit = {"value": 1e-5, "standard_error": 1e-5, "explained": True}
    assert not diagnosis.still_falling(result | {"report": {"passes": 1, "misfit": misfit}})


def test_only_the_last_stage_is_judged():
    """Another height is another loss."""
    seen = history({"Body:roughness": converged(41)}, [0.1] * 20 + [0.01] * 21, error=1e-6)
    result = {"history": seen, "stopped": StopReason.ITERATIONS}
    seen["stage"] = np.array([1] * 20 + [2] * 21)
    assert not diagnosis.still_falling(result)
    seen["validation"][35] = 0.005
    assert "(0.01 at iteration 30, 0.005 at 35)" in diagnosis.still_falling(result)[0]


@pytest.mark.parametrize("answers", [1, 6])
def test_the_loss_in_the_weights_of_the_answer_is_no_fall(answers):
    """Rows of the same iteration: the answer, then what a refinement makes of it."""
    losses = [0.04] * 40 + [0.004] * answers
    seen = history({"Body:roughness": converged(len(losses))}, losses, error=1e-6)
    seen["iteration"] = np.minimum(seen["iteration"], 40)
    result = {"history": seen, "stopped": StopReason.ITERATIONS}
    assert not diagnosis.still_falling(result)
