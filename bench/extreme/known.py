# SPDX-License-Identifier: GPL-3.0-or-later
"""Places where the picture has no slope, or where the carried derivative is not it, and why.

A verdict that is listed here does not fail; the same verdict anywhere else does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .scenes import Values

FINE = ("agrees", "zero")
#: Noise leaves nothing to compare: no failure, but no proof either.
OPEN = "noisy"
#: Roughness at which a mirror ends: the square of its width is the singular cut of 2e-10.
CUT = (2e-10) ** 0.25

Where = Callable[[float, float, Values], bool]


def _glass(values: Values) -> bool:
    return values.get("transmission", 0) > 0


def _smooth(values: Values) -> bool:
    return values.get("roughness", 0.5) <= CUT


def _matched(at: float, step: float, values: Values) -> bool:
    return abs(at - 1) < 0.02


#: (parameter, where, verdicts, reason)
_PLACES: tuple[tuple[str, Where, tuple[str, ...], str], ...] = (
    ("base_color", lambda at, step, v: at == 0 and _glass(v), ("no limit", "dead"),
     "light that passes one face takes the root of the colour"),
    ("specular_level", lambda at, step, v: at == 0, ("no limit", "dead"),
     "energy tables run over its fourth root"),
    ("coat_tint", lambda at, step, v: at == 0, ("dead",),
     "a power of 1 to 1.3: falls to 0 more slowly than differences show"),
    ("ior", lambda at, step, v: _matched(at, step, v) and not _glass(v), ("no limit", "dead"),
     "energy tables run over the root of the excess"),
    ("ior", lambda at, step, v: _matched(at, step, v) and _glass(v), ("no limit", "dead"),
     "the picture jumps where refraction becomes straight, within 1e-4 of 1"),
    ("ior", lambda at, step, v: _glass(v) and _smooth(v), ("dead",),
     "the direction of a smooth refraction carries no derivative"),
    ("subsurface_radius", lambda at, step, v: at == 0, ("no limit", "dead"),
     "the picture jumps: diffuse reflection instead of a walk"),
    ("subsurface_scale", lambda at, step, v: at == 0, ("no limit", "dead"),
     "the picture jumps: diffuse reflection instead of a walk"),
)  # fmt: skip


def reason(name: str, at: float, step: float, values: Values, verdict: str) -> str:
    """Why a verdict other than FINE is right there; empty if nothing is known."""
    plain = {key: value for key, value in values.items() if np.ndim(value) == 0}
    for parameter, where, verdicts, why in _PLACES:
        if parameter == name and verdict in verdicts and where(at, step, plain):
            return why
    return ""
