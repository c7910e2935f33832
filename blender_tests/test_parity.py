# SPDX-License-Identifier: GPL-3.0-or-later
"""Selenite against Cycles, rendered on the spot: a few settings of `./dev bench parity`.

Same judgement, fewer samples: the bias may exceed its limit by four of its standard deviations, so
that a new seed would raise a false alarm once in about 1500 runs of this file.
"""

import numpy as np
import parity_cases as parity
import pytest

pytestmark = pytest.mark.blender

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
