# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of `./dev bench fit` are the same natively and in Blender, whose Cycles photographs
them in a process of its own."""

import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench"))

from synthetic import blender_scene, cycles_photos, fits, scenes, stage  # noqa: E402
from synthetic.cases import make  # noqa: E402

from selenite import native  # noqa: E402
from selenite.cycles_check.compare import Estimate, judge  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402
from selenite.scene_read.scene import read_scene  # noqa: E402

SIZE = 24


def true_scene(case):
    """Native scene at the target."""
    at_target = {(scenes.OWNER, name): value for name, value in case.target.items()}
    return fits.scene_of(case).with_values(at_target)


@pytest.mark.parametrize(("kind", "seed"), [("medium", 0), ("half", 4)])
def test_the_scene_in_blender_reads_back_as_the_native_one(kind, seed):
    """Under the lamp and under the sky; the mesh is the one that needs no file."""
    case = make(kind, seed)
    described = stage.make(case.mesh, case.lighting, case.cameras)
    opened = blender_scene.make(described, case.fixed | case.target)
    opened.render.resolution_x = opened.render.resolution_y = SIZE
    read = read_scene(opened)
    assert not read.problems
    ours, theirs = (
        np.asarray(native.core().render(one, "Camera 1", SIZE, SIZE, 8, seed=3).image)
        for one in (true_scene(case), build(read))
    )
    # Rounding sends a path or two another way; all others are the same.
    assert np.median(np.abs(ours - theirs)) < 1e-5
    assert theirs.mean() == pytest.approx(ours.mean(), rel=5e-3)


def test_a_photo_by_cycles_is_ours_within_its_noise():
    """Under the sky: with few samples the lamp's errors are no bell curve. False alarms: below 1 in
    1000 for three channels at four standard deviations."""
    case = make("medium", 4)
    cover = scenes.coverage(case.mesh, case.lighting, 1, SIZE) > 0.99
    film = native.core().render(true_scene(case), "Camera 1", SIZE, SIZE, 256, seed=5)
    ours = Estimate.of_film(film)
    made = cycles_photos.take(
        case.mesh, case.lighting, 1, case.fixed | case.target, SIZE, 128, cover, noise=1.0
    )
    assert made.samples == 128
    assert made.mean.shape == (1, SIZE, SIZE, 3)
    verdict = judge(ours, Estimate(made.mean[0].astype(float), made.variance[0]), cover[0])
    assert (np.abs(verdict.bias) <= 0.005 + 4 * verdict.bias_noise).all()
    assert verdict.bias_noise.max() < 0.02


def test_a_renderer_that_fails_says_so():
    cover = np.ones((1, 4, 4), bool)
    with pytest.raises(RuntimeError, match="no parameter"):
        cycles_photos.take("dents", "lamp", 1, {"no_such_thing": 1.0}, 4, 4, cover, noise=1.0)


def test_coverage_shows_the_object_and_not_its_light():
    cover = scenes.coverage("dents", "sky", 2, SIZE)
    assert cover.shape == (2, SIZE, SIZE)
    assert cover.max() == pytest.approx(1, abs=1e-6)
    assert (cover[:, 0] == 0).all()
    assert 0.2 < (cover > 0.99).mean() < 0.5
    assert bpy.context.scene is not None
