# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds made of nodes: Cycles evaluates them to equirectangular images, one for each kind of ray
that sees another background."""

from .evaluate import Panorama, evaluate
from .rays import (
    LIGHT,
    OTHERS,
    Rays,
    is_background,
    is_spatial,
    require_direction_only,
    surface_of,
    used_outputs,
)

__all__ = [
    "LIGHT",
    "OTHERS",
    "Panorama",
    "Rays",
    "evaluate",
    "is_background",
    "is_spatial",
    "require_direction_only",
    "surface_of",
    "used_outputs",
]
