# SPDX-License-Identifier: GPL-3.0-or-later
"""When other lights than its own explain a photo."""

from __future__ import annotations

import pytest

from selenite.fit_run.answer.light_pairing import explains


@pytest.mark.parametrize(
    ("other", "own", "expected"),
    [
        (0.1, 0.9, True),
        (0.4, 1.5, True),
        (0.5, 0.6, False),  # as wrong as its own
        (0.85, 1.53, False),  # neither is like the photo: the body is of another kind
    ],
)
def test_lights_that_explain_nothing_are_not_said_to_be_the_right_ones(other, own, expected):
    assert explains(other**2, own**2) is expected
