# SPDX-License-Identifier: GPL-3.0-or-later
"""The native fit from Python: every setting and number arrives, in its place and order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from selenite import _core

SIZE = 12
CAMERA = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]], float)
TRUTH = (0.7, 0.4, 0.2)


def scene(color: tuple[float, ...] = TRUTH) -> Any:
    """A matte board that fills the picture under a white sky."""
    builder = _core.SceneBuilder()
    values = {"base_color": color, "roughness": 1.0, "specular_level": 0.0}
    material = builder.add_material("Body", values)
    corners = np.array([(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3)], np.int32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (6, 1))
    mesh = builder.add_mesh("Board", corners, triangles, normals, np.zeros(2, np.int32))
    builder.add_object("Board", mesh, np.eye(4), [material])
    builder.add_camera("Camera", CAMERA, "PERSP", 50, 36, 24, "AUTO", 0, 0, 6, 0.1, 100)
    builder.set_world((1.0, 1.0, 1.0), 1.0)
    return builder.build()


def photo(more: tuple[float, ...] = (0, 0, 0), name: str = "Front") -> Any:
    """What the board looks like with the true colour, and `more` light in it."""
    film = _core.render(scene(), "Camera", SIZE, SIZE, 64, seed=99)
    reference = np.ascontiguousarray(film.image + np.array(more, np.float32), np.float32)
    return _core.Photo("Camera", reference, id=name)


def color(**more: Any) -> Any:
    return _core.Unknown(
        "Body", "base_color", **({"minimum": 0.001, "maximum": 0.999, "start": TRUTH} | more)
    )


def result(settings: dict[str, Any], unknown: Any = None, **more: Any) -> Any:
    """Of a small fit of the colour by Adam, in one thread."""
    usual = {"optimiser": "adam", "iterations": 3, "spp": 4, "tolerance": 0.0, "threads": 1,
             "search": "off", "refinement": "off"}  # fmt: skip
    photos = more.get("photos") or [photo()]
    fit = _core.Fit(scene(), photos, [unknown or color()], usual | settings)
    fit.start()
    fit.join()
    found = fit.result()
    assert not found.problems
    return found


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("loss", "l2", "'l2'"),
        ("optimiser", "sgd", "'sgd'"),
        ("iterations", -3, "iterations = -3"),
        ("spp", -3, "spp = -3"),
        ("tolerance", -3.0, "tolerance = -3"),
        ("depth", -3, "depth = -3"),
        ("threads", -3, "threads = -3"),
        ("validation_interval", -3, "validation_interval = -3"),
        ("validation_spp", -3, "validation_spp = -3"),
        ("refinement_spp", -3, "refinement_spp = -3"),
        ("search", "never", "search = 'never'"),
        ("refinement", "never", "refinement = 'never'"),
    ],
)
def test_a_setting_that_is_wrong_is_named(name: str, value: object, message: str) -> None:
    """Each arrives under its own name: one that is ignored would be accepted."""
    with pytest.raises(ValueError, match=message):
        _core.Fit(scene(), [photo()], [color()], {name: value})


def test_gauss_newton_without_accumulate_is_refused() -> None:
    settings = {"optimiser": "gauss-newton", "accumulate": False}
    with pytest.raises(ValueError, match="accumulate"):
        _core.Fit(scene(), [photo()], [color()], settings)


def test_another_seed_is_other_noise() -> None:
    one, other = (result({"seed": seed}).history.loss[0] for seed in (1, 2))
    assert one != other
    assert result({"seed": 1}).history.loss[0] == one


def test_iterations_are_counted() -> None:
    assert len(result({"iterations": 2}).history.iteration) == 3


def test_accumulate_makes_one_step_for_all_photos() -> None:
    """Adam's first step is as long as the rate: of two photos one step, or two."""
    photos = [photo((0.2, 0.2, 0.2)), photo((0.2, 0.2, 0.2), "Again")]
    moved = [
        result({"iterations": 1, "accumulate": on}, photos=photos).values_last["Body:base_color"]
        for on in (True, False)
    ]
    assert moved[0][1] - TRUTH[1] == pytest.approx(0.03, abs=1e-4)
    assert moved[1][1] - TRUTH[1] == pytest.approx(0.06, abs=0.01)


def test_the_bias_is_render_minus_photo_in_red_green_and_blue() -> None:
    found = result({"iterations": 1, "spp": 64}, photos=[photo((0.1, -0.2, 0.3))])
    bias = found.history.mean_bias
    assert bias.shape == (2, 3)
    assert bias[0] == pytest.approx([-0.1, 0.2, -0.3], abs=0.02)


def test_best_and_last_values_are_told_apart() -> None:
    """From the truth in long steps: nothing is better than the start."""
    settings = {"validation_interval": 1, "spp": 16, "loss": "dual-buffer"}
    found = result(settings, color(learning_rate=0.2))
    name, best = "Body:base_color", found.best_iteration
    history = found.history.values[name]
    assert best < 3 and np.abs(history[best] - history[-1]).max() > 0.05
    assert found.values_best[name] == pytest.approx(history[best])
    assert found.values_last[name] == pytest.approx(history[-1])
    assert found.best_validation == found.history.validation[best]


def test_the_report_has_the_channels_in_order() -> None:
    """Red cannot go as high as it should, and blue not as low."""
    settings = {"optimiser": "gauss-newton", "iterations": 12, "spp": 16, "refinement": "on"}
    found = result(settings, color(minimum=0.3, maximum=0.6, start=[0.45, 0.45, 0.45]))
    report = found.report.parameters["Body:base_color"]
    assert found.values_best["Body:base_color"] == pytest.approx([0.6, 0.4, 0.3], abs=0.01)
    assert report.at_bound == ["maximum", None, "minimum"]
    low, high = report.interval_90[1]
    assert low < 0.4 + 0.01 and high > 0.4 - 0.01 and high - low < 0.05
    assert all(0 < error < 0.05 for error in report.standard_error)


def test_values_of_several_parameters_keep_their_names() -> None:
    world = _core.Unknown("World", "strength", 0.1, 3.0, 1.5, 0.1)
    fit = _core.Fit(scene(), [photo()], [world, color()], {"iterations": 1, "optimiser": "adam"})
    state = fit.progress()
    assert state.values == {"World:strength": [1.5], "Body:base_color": pytest.approx(TRUTH)}
    assert state.iterations == 1
    fit.start()
    fit.join()
    found = fit.result().history.values
    assert found["World:strength"][0] == pytest.approx([1.5])
    assert found["Body:base_color"][0] == pytest.approx(TRUTH)
    assert found["World:strength"][1] == pytest.approx([1.4])
    assert fit.preview(0).shape == (SIZE, SIZE, 3)


def test_a_result_without_fields_is_the_same_otherwise() -> None:
    vertices = _core.Unknown("Board", "vertex_positions", minimum=-3.0, maximum=3.0)
    settings = {"iterations": 2, "spp": 4, "threads": 1, "search": "off"}
    fit = _core.Fit(scene((0.5, 0.5, 0.5)), [photo()], [vertices], settings)
    fit.start()
    fit.join()
    whole, bare = fit.result(), fit.result(fields=False)
    assert not whole.problems
    assert whole.fields_best["Board:vertex_positions"].shape == (4, 3)
    assert whole.fields_last["Board:vertex_positions"].shape == (4, 3)
    assert bare.fields_best == bare.fields_last == {}
    assert bare.iterations == whole.iterations == 2
    np.testing.assert_array_equal(bare.history.loss, whole.history.loss)
