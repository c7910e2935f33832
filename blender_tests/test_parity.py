# SPDX-License-Identifier: GPL-3.0-or-later
"""Selenite against Cycles, rendered on the spot: a few settings of `./dev bench parity`.

Same judgement, fewer samples: the bias may exceed its limit by four of its standard deviations, so
that a new seed would raise a false alarm once in about 1500 runs of this file.
"""

import bpy
import numpy as np
import parity_cases as parity
import pytest

from selenite import native
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.slow]

EFFORT = parity.Effort(samples=32, seeds=6, native_samples=256, rounds=1)
SIZE = 40


@pytest.mark.parametrize("case", [c for c in parity.CASES if c.fast], ids=lambda case: case.name)
def test_cycles_renders_the_same(case, tmp_path):
    parity.make(case, SIZE)
    mask = parity.mask_of()
    assert 300 < mask.sum() < 1200
    verdict, ours, cycles = parity.compare(mask, tmp_path, EFFORT)
    assert verdict.z_rms < 1.3
    assert (np.abs(verdict.bias) <= verdict.largest_bias + 4 * verdict.bias_noise).all(), (
        verdict.bias,
        verdict.bias_noise,
    )


def test_another_roughness_is_noticed(tmp_path):
    """The same judgement refuses a picture of a roughness that is 0.05 off."""
    parity.make(parity.Case("", "lamp", {"metallic": 1.0, "roughness": 0.3}), SIZE)
    mask = parity.mask_of()
    _, _, cycles = parity.compare(mask, tmp_path, EFFORT)
    parity.make(parity.Case("", "lamp", {"metallic": 1.0, "roughness": 0.35}), SIZE)
    _, ours, _ = parity.compare(mask, tmp_path, EFFORT)
    assert not parity.judge(ours, cycles, mask).passed


def test_physical_refraction_leaves_out_what_only_cycles_adds():
    """Rough glass lit by a sun alone: all of its extra refraction counts
    (docs/method/rendering.md)."""
    parity.make(parity.Case("", "sun", {"transmission": 1.0, "roughness": 0.7}), SIZE)
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0
    mask = parity.mask_of()
    means = []
    for physical in (False, True):
        values = read_scene(bpy.context.scene)
        values.physical_refraction = physical
        film = native.core().render(build(values), "Camera", SIZE, SIZE, 256, seed=1)
        means.append(film.image[mask].mean())
    assert means[1] < 0.95 * means[0], means
