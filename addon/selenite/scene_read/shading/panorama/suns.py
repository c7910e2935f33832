# SPDX-License-Identifier: GPL-3.0-or-later
"""The sun disc of a Sky Texture, which is smaller than a pixel of a panorama."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np

from .. import nodes
from ..nodes import Output, Unreadable
from .rays import Rays, reached

#: Radians; a panorama shows larger discs by itself.
_LARGEST = math.radians(5)
#: The picture of a disc is wider than the disc, so that pixels at its edge are in it.
_MARGIN = 1.05
_WITHOUT_DISC = {"PREETHAM", "HOSEK_WILKIE"}


@dataclass(frozen=True, eq=False)
class Disc:
    """axis (3,): to the sun, unit. up (3,): to the top of its picture. radius: radians, with a
    margin."""

    axis: np.ndarray
    up: np.ndarray
    radius: float


def find(output: Output, rays: Rays, title: str) -> Disc | None:
    """The disc that is too small for a panorama, if these rays see one. Raises Unreadable."""
    skies = {}
    for source in reached(output.source("Surface"), rays):
        node = source.node
        if (
            node.bl_idname == "ShaderNodeTexSky"
            and node.sky_type not in _WITHOUT_DISC
            and node.sun_disc
            and node.sun_size / 2 <= _LARGEST
        ):
            skies[(tuple(group.name for group in source.groups), node.name)] = source
    if not skies:
        return None
    first = next(iter(skies.values()))
    cure = "switch off the Sun Disc and add a sun lamp"
    if len(skies) > 1:
        raise Unreadable(title, f"{len(skies)} of its Sky Textures have a sun disc", cure)
    vector: bpy.types.NodeSocket | None = first.node.inputs.get("Vector")
    if vector is not None and nodes.link_of(vector) is not None:
        cause = f"{nodes.describe(first.node)} has a sun disc, and a Vector that moves it"
        raise Unreadable(title, cause, cure)
    high, turn = float(first.node.sun_elevation), float(first.node.sun_rotation)
    axis = np.array(
        [math.cos(high) * math.sin(turn), math.cos(high) * math.cos(turn), math.sin(high)]
    )
    up = np.array(
        [-math.sin(high) * math.sin(turn), -math.sin(high) * math.cos(turn), math.cos(high)]
    )
    return Disc(axis, up, _MARGIN * float(first.node.sun_size) / 2)
