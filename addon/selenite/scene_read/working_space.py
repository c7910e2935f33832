# SPDX-License-Identifier: GPL-3.0-or-later
"""The space in which Blender's colour management computes: Blender 5 has it as a setting, and the
variable OCIO may name a configuration with another one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import mathutils
import numpy as np

from ..problems import Problem

if TYPE_CHECKING:
    from .hosts import BpyStruct

#: What Blender's own configuration is off by, with room to spare.
_SAME = 1e-3


def problems(scene: bpy.types.Scene) -> list[Problem]:
    """Photos, images and values are linear Rec. 709 here; Cycles would take them for something
    else. (With ACEScg a base colour of .55 .20 .10 was fitted as .80 .16 .08, without a word.)"""
    if np.abs(_from_rec709() - np.eye(3)).max() <= _SAME:
        return []
    cause = "its colours are computed in another space than linear Rec. 709"
    cure = (
        "set the file's Working Space to Linear Rec.709, or start Blender without the variable OCIO"
    )
    return [Problem(f"Scene '{scene.name}'", cause, cure)]


def _from_rec709() -> np.ndarray:
    """(3, 3): rows are what becomes of the primaries."""
    made: list[BpyStruct] = [
        mathutils.Color(one).from_rec709_linear_to_scene_linear() for one in np.eye(3).tolist()
    ]
    return np.array([list(one) for one in made])
