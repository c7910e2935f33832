# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras whose numbers are known, and where they see points: what files are written from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from selenite.importers.reconstruction import ReconstructedCamera, Reconstruction

WIDTH, HEIGHT = 640, 480
#: In front of every camera, with some at the corners of its photo.
POINTS = np.random.default_rng(3).uniform(-0.9, 0.9, (200, 3))
#: Pixels: what a reader may lose.
MOST = 1e-6
FLIP = np.diag([1.0, -1.0, -1.0])


@dataclass(frozen=True)
class Lens:
    """A pinhole with Brown's distortion; p1 and p2 in OpenCV's order."""

    fx: float = 520.0
    fy: float = 520.0
    cx: float = WIDTH / 2
    cy: float = HEIGHT / 2
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0


#: All of it; moves the corners by some 10 pixels.
FULL = Lens(521.5, 518.25, 327.125, 233.5, -0.11, 0.07, -0.02, 0.0017, -0.0023)


@dataclass(frozen=True)
class Known:
    """x_camera = rotation (x - centre), looking along +z with y down."""

    label: str
    rotation: np.ndarray
    centre: np.ndarray
    lens: Lens = field(default_factory=Lens)

    @property
    def translation(self) -> np.ndarray:
        """x_camera = rotation x + translation."""
        return -self.rotation @ self.centre


def known(count: int = 5, lens: Lens = FULL, at: float = 0.0) -> list[Known]:
    """Cameras around `at`, at a distance of about 4, each with another roll."""
    random = np.random.default_rng(7)
    found = []
    for index in range(count):
        direction = random.normal(size=3)
        direction /= np.linalg.norm(direction)
        forward = -direction
        right = np.cross(forward, random.normal(size=3))
        right /= np.linalg.norm(right)
        down = np.cross(forward, right)
        centre = direction * random.uniform(3.6, 4.4) + at
        found.append(Known(f"IMG_{index:04d}.JPG", np.stack([right, down, forward]), centre, lens))
    return found


def expected(camera: Known, points: np.ndarray) -> np.ndarray:
    """(n, 2) pixels, by OpenCV's formulas."""
    lens = camera.lens
    x, y, z = camera.rotation @ (points - camera.centre).T
    assert (z > 0.5).all()
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + lens.k3 * r2**3
    u = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x)
    v = y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y
    return np.stack([lens.fx * u + lens.cx, lens.fy * v + lens.cy], axis=-1)


def seen(camera: ReconstructedCamera, points: np.ndarray) -> np.ndarray:
    """(n, 2) pixels of a camera that was read, as `LensDistortion` says it."""
    assert camera.intrinsics is not None
    lens = camera.intrinsics.lens
    matrix = camera.camera_to_world
    x, y, z = matrix[:3, :3].T @ (points - matrix[:3, 3]).T
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + lens.k1 * r2 + lens.k2 * r2**2 + lens.k3 * r2**3 + lens.k4 * r2**4
    more = 1 + lens.p3 * r2 + lens.p4 * r2**2
    u = x * radial + (lens.p1 * (r2 + 2 * x * x) + 2 * lens.p2 * x * y) * more
    v = y * radial + (lens.p2 * (r2 + 2 * y * y) + 2 * lens.p1 * x * y) * more
    return np.stack([lens.fx * u + lens.b2 * v + lens.cx, lens.fy * v + lens.cy], axis=-1)


def worst(found: Reconstruction, cameras: list[Known], at: float = 0.0) -> float:
    """Pixels by which any point is elsewhere in any camera; all of them have to be there."""
    by_label = {camera.label: camera for camera in found.cameras}
    assert sorted(by_label) == sorted(camera.label for camera in cameras)
    return max(
        float(np.abs(seen(by_label[one.label], POINTS + at) - expected(one, POINTS + at)).max())
        for one in cameras
    )


def text(values: np.ndarray) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(value)) for value in np.asarray(values).reshape(-1))


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """w, x, y, z of a rotation, by the eigenvector of Shepperd's symmetric matrix."""
    m = rotation
    symmetric = np.array(
        [
            [m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [0, m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]],
            [0, 0, m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2]],
            [0, 0, 0, m[2, 2] - m[0, 0] - m[1, 1]],
        ]
    )
    return np.linalg.eigh(symmetric, UPLO="U")[1][:, -1]


def picture(path: Path, width: int = WIDTH, height: int = HEIGHT) -> None:
    """A photo whose size can be read."""
    from PIL import Image

    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("L", (width, height)).save(path)
