# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a photo that a lens distorts shows what the camera of the scene renders in each pixel.

Metashape's model, which is Brown's: with x, y the slopes of a ray and r^2 = x^2 + y^2,

    radial = 1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8, more = 1 + p3 r^2 + p4 r^4
    x' = x radial + (p1 (r^2 + 2 x^2) + 2 p2 x y) more
    y' = y radial + (p2 (r^2 + 2 y^2) + 2 p1 x y) more

and the photo's pixel is (cx + fx x' + b2 y', cy + fy y'). OpenCV has p1 and p2 exchanged.
Source: Brown, Close-range camera calibration, Photogrammetric Engineering 37 (1971); Agisoft
Metashape User Manual, appendix "Camera models".
"""

from __future__ import annotations

import numpy as np

from ..scene_read.lens import LensDistortion
from .window import PhotoWindow, Projection

#: Beyond these, lens and camera are not of the same photo: shares of the focal length, and of the
#: photo's longer side.
_FOCAL, _CENTRE = 0.02, 0.02
#: A share of a picture's corners. Beyond it, what folds back is no rim of a wide lens.
_FOLDED = 0.05
#: Corners at a time.
_BLOCK = 16_384


def distorted(lens: LensDistortion, slopes: np.ndarray) -> np.ndarray:
    """(..., 2) slopes of rays -> (..., 2) pixels of the whole photo; NaN where the model folds
    back, so that one place of the photo would be that of two rays."""
    x, y = slopes[..., 0], slopes[..., 1]
    r2, xy = x * x + y * y, 2 * x * y
    radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * (lens.k3 + r2 * lens.k4)))
    more = 1 + r2 * (lens.p3 + r2 * lens.p4)
    out = np.empty(slopes.shape, np.float64)
    across = radial * x + (lens.p1 * (r2 + 2 * x * x) + lens.p2 * xy) * more
    down = radial * y + (lens.p2 * (r2 + 2 * y * y) + lens.p1 * xy) * more
    out[..., 0] = lens.cx + lens.fx * across + lens.b2 * down
    out[..., 1] = lens.cy + lens.fy * down
    out[r2 >= _folds_at(lens)] = np.nan
    return out


def _folds_at(lens: LensDistortion) -> float:
    """The least r^2 at which r (1 + k1 r^2 + ... + k4 r^8) stops to grow; infinite if none."""
    roots = np.roots([9 * lens.k4, 7 * lens.k3, 5 * lens.k2, 3 * lens.k1, 1.0])
    real = roots[(np.abs(roots.imag) < 1e-9 * (1 + np.abs(roots.real))) & (roots.real > 0)].real
    return float(real.min()) if real.size else np.inf


def corners(
    lens: LensDistortion,
    camera: Projection,
    window: PhotoWindow,
    file_size: tuple[int, int],
    columns: int,
    rows: int,
) -> np.ndarray:
    """(rows + 1, columns + 1, 2): where the corners of a picture's pixels lie in the file, in its
    pixels; NaN for nowhere. The picture shows the window as the camera renders it."""
    left, top, right, bottom = window.crop
    across = left + (right - left) * np.arange(columns + 1) / columns
    down = top + (bottom - top) * np.arange(rows + 1) / rows
    scale = file_size[0] / (right - left), file_size[1] / (bottom - top)
    found = np.empty((rows + 1, columns + 1, 2))
    # In blocks that a processor's cache holds: a large photo has hundreds of megabytes of them.
    block = max(1, _BLOCK // (columns + 1))
    for first in range(0, rows + 1, block):
        part = found[first : first + block]
        slopes = np.empty(part.shape)
        slopes[..., 0] = ((across - camera.centre[0]) / camera.focal[0])[None, :]
        slopes[..., 1] = ((down[first : first + block] - camera.centre[1]) / camera.focal[1])[
            :, None
        ]
        part[:] = distorted(lens, slopes)
        part -= (left, top)
        part *= scale
    return found


def disagreement(lens: LensDistortion, camera: Projection, window: PhotoWindow) -> str:
    """How the lens differs from the camera of the scene beyond what a calibration may; "" if it
    does not. Each pixel is still taken from where the photo shows its ray."""
    side = max(window.size)
    focal = max(abs(lens.fx / camera.focal[0] - 1), abs(lens.fy / camera.focal[1] - 1))
    centre = np.hypot(lens.cx - camera.centre[0], lens.cy - camera.centre[1])
    if focal <= _FOCAL and centre <= _CENTRE * side:
        return ""
    return (
        f"its distortion has focal lengths {lens.fx:.1f}, {lens.fy:.1f} and centre "
        f"{lens.cx:.1f}, {lens.cy:.1f} pixels, its camera {camera.focal[0]:.1f}, "
        f"{camera.focal[1]:.1f} and {camera.centre[0]:.1f}, {camera.centre[1]:.1f}: "
        "check focal length and shift of the camera"
    )


def folded(places: np.ndarray) -> str:
    """How much of the picture the lens shows nowhere, since its model folds back; "" for a rim.
    places: those of `corners`."""
    share = float(np.isnan(places[..., 0]).mean())
    if share <= _FOLDED:
        return ""
    return (
        f"{share:.0%} of what its camera takes lies where its distortion folds back, and does not "
        "count: check k1, k2, k3; they belong to slopes, not to pixels"
    )


def misses(places: np.ndarray, file_size: tuple[int, int]) -> bool:
    """Whether the file shows nothing of the picture. places: those of `corners`."""
    inside = ((places >= 0) & (places <= file_size)).all(-1)  # false for NaN
    return not inside.any()
