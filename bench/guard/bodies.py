# SPDX-License-Identifier: GPL-3.0-or-later
"""The ten bodies: shapes, light, what is true, where a fit starts. No test fits one of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from synthetic import stage

from . import shapes

#: Pixels of the square photos.
SIZE = 80
Values = dict[str, tuple[float, ...]]


@dataclass(frozen=True)
class Body:
    """lamp: side and power (W) of a square lamp. world: its grey radiance. views: azimuths of the
    cameras in degrees. target and start: of what is fitted, fixed: of the rest."""

    name: str
    shape: str
    lamp: tuple[float, float]
    world: float
    views: tuple[float, ...]
    target: Values
    start: Values
    fixed: dict[str, Any] = field(default_factory=dict)

    @property
    def fitted(self) -> str:
        """As `selenite fit --fit` takes it."""
        return "Body:" + ",".join(self.target)

    def stage(self) -> stage.Stage:
        """On the chequered floor of the other benches."""
        positions, triangles = shapes.standing(shapes.SHAPES[self.shape]())
        middle = np.array((0, 0, positions[:, 2].max() / 2))
        normals = stage.normals(positions, triangles)
        body = stage.Mesh(positions, triangles, normals, np.zeros(len(triangles), int))
        side, power = self.lamp
        lamp = stage.Lamp(stage.look_at(np.array((-2.2, -2.4, 3.6)), middle), power, side)
        eyes = [
            middle + 5.0 * np.array((np.cos(angle), np.sin(angle), 0.4))
            for angle in np.radians(self.views)
        ]
        cameras = tuple(stage.look_at(eye, middle) for eye in eyes)
        floor = stage.make("dents", "lamp", 0).floor
        return stage.Stage(body, floor, lamp, (self.world,) * 3, None, cameras)


def _surface(colour: tuple[float, float, float], **scalars: float) -> Values:
    return {"base_color": colour} | {name: (value,) for name, value in scalars.items()}


def _medium(
    albedo: tuple[float, float, float], extinction: float, roughness: float, ior: float
) -> Values:
    values = {"albedo": albedo, "extinction": (extinction,) * 3}
    return values | {"roughness": (roughness,), "ior": (ior,)}


_GREY = _surface((0.5, 0.5, 0.5), roughness=0.5, transmission=0.5, ior=1.45)
_FOG = _medium((0.6, 0.6, 0.6), 3.0, 0.4, 1.45)
_CLEAR = {"base_color": [1.0] * 3, "transmission": 1.0}

BODIES = (
    Body(
        "opaque vase", "vase", (1.6, 180), 0.35, (-70,),
        _surface((0.62, 0.36, 0.22), roughness=0.32, transmission=0.0, ior=1.5), _GREY,
    ),
    Body(
        "half bowl", "bowl", (2.2, 250), 0.25, (-110, 20),
        _surface((0.85, 0.62, 0.5), roughness=0.22, transmission=0.55, ior=1.42), _GREY,
    ),
    Body(
        "half ring", "ring", (1.2, 200), 0.5, (-90,),
        _surface((0.35, 0.6, 0.8), roughness=0.15, transmission=0.3, ior=1.55), _GREY,
    ),
    Body(
        "brass pawn", "pawn", (1.8, 220), 0.4, (-60,),
        _surface((0.88, 0.66, 0.32), roughness=0.28), _surface((0.5, 0.5, 0.5), roughness=0.5),
        {"metallic": 1.0},
    ),
    Body(
        "metal pebble", "pebble", (2.5, 250), 0.3, (-100, 60),
        _surface((0.7, 0.72, 0.78), roughness=0.4, metallic=0.9),
        _surface((0.5, 0.5, 0.5), roughness=0.5, metallic=0.5),
    ),
    Body(
        "thin medium", "soap", (2.0, 220), 0.4, (-80,),
        _medium((0.85, 0.6, 0.4), 0.5, 0.08, 1.36), _FOG, _CLEAR,
    ),
    Body(
        "wax", "pebble", (2.0, 250), 0.3, (-70,),
        _medium((0.95, 0.9, 0.8), 2.5, 0.15, 1.4), _FOG, _CLEAR,
    ),
    Body(
        "jade pawn", "pawn", (1.2, 240), 0.3, (-90, 50),
        _medium((0.55, 0.88, 0.66), 6.0, 0.3, 1.55), _FOG, _CLEAR,
    ),
    Body(
        "ink ring", "ring", (2.4, 260), 0.45, (-60,),
        _medium((0.3, 0.55, 0.9), 1.3, 0.2, 1.33), _FOG, _CLEAR,
    ),
    Body(
        "milk bowl", "bowl", (1.5, 240), 0.25, (-120,),
        _medium((0.97, 0.95, 0.9), 9.0, 0.45, 1.48), _FOG, _CLEAR,
    ),
)  # fmt: skip
