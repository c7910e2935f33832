# SPDX-License-Identifier: GPL-3.0-or-later
"""The lens of a camera: what distorts its photos."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

#: What of a lens is no distortion, and what few calibrations have.
_PINHOLE = ("fx", "fy", "cx", "cy")
RARE = ("k4", "p3", "p4", "b2")


@dataclass(frozen=True)
class LensDistortion:
    """Metashape's model, which takes ideal image points to those of the photo: radial k1 to k4,
    tangential p1 to p4, skew b2 in pixels. Focal lengths and principal point in pixels of the whole
    photo, whose first pixel has its centre at (0.5, 0.5)."""

    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k4: float = 0.0
    p3: float = 0.0
    p4: float = 0.0
    b2: float = 0.0

    @property
    def distorts(self) -> bool:
        """Whether any coefficient differs from 0."""
        return any(value for name, value in asdict(self).items() if name not in _PINHOLE)

    def at_scale(self, across: float, down: float) -> LensDistortion:
        """The same lens for a photo of so many times the pixels."""
        return replace(
            self,
            fx=self.fx * across,
            fy=self.fy * down,
            cx=self.cx * across,
            cy=self.cy * down,
            b2=self.b2 * across,
        )

    def as_json(self) -> dict[str, float]:
        """A dict of plain values, without the coefficients of RARE that are 0."""
        return {name: value for name, value in asdict(self).items() if value or name not in RARE}


@dataclass(frozen=True)
class CameraLens:
    """Of a camera that was imported, whether it has a photo or not: its calibration, in pixels of a
    photo of `size` (width, height)."""

    size: tuple[int, int]
    lens: LensDistortion
