# SPDX-License-Identifier: GPL-3.0-or-later
"""Which pixels of a photo show what is fitted: alpha, mask and exclude files, silhouette and
background together, without the rim."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..messages import phrase, remark, thing
from ..problems import Problem
from .background import Background
from .request import CaptureRequest
from .silhouette import Silhouettes

if TYPE_CHECKING:
    from .._core import Frame

#: Pixels of the working size that are taken off wherever a mask ends: camera and geometry are
#: seldom known better.
RIM = 1
_BORDER_CURE = "give border, border:0.1, or R,G,B in linear light"


def background_of(request: CaptureRequest, problems: list[Problem]) -> Background | None:
    """None where none is asked for, or, with a problem, where it cannot be read."""
    if not request.background:
        return None
    try:
        return Background.from_text(request.background)
    except ValueError as error:
        title = thing("Photo", request.photo)
        problems.append(
            Problem(phrase("{about}, background", about=title), str(error), _BORDER_CURE)
        )
        return None


def within_silhouette(
    request: CaptureRequest,
    size: tuple[int, int],
    frame: Frame,
    silhouettes: Silhouettes,
    problems: list[Problem],
) -> np.ndarray | None:
    """(h, w) bool of the pixels that show the fitted objects; None where that is not asked for, or,
    with a problem, where nothing is left. size: (width, height)."""
    if request.silhouette is None:
        return None
    title = thing("Photo", request.photo)
    try:
        seen = silhouettes.inside(request.camera, frame, size)
    except ValueError as error:
        cause = f"its silhouette cannot be rendered ({error})"
        problems.append(Problem(title, cause, "correct the scene, or give a mask"))
        return None
    if not seen.any():
        cause = f"camera '{request.camera}' sees nothing of the fitted objects"
        cure = "correct the camera, or leave out its 'silhouette'"
        problems.append(Problem(title, cause, cure))
        return None
    return eroded(seen, request.silhouette)


def masked(
    request: CaptureRequest,
    reference: np.ndarray,
    weight: np.ndarray,
    of_files: np.ndarray,
    silhouette: np.ndarray | None,
    problems: list[Problem],
    remarks: list[str],
) -> tuple[np.ndarray, np.ndarray | None]:
    """The weight (h, w) within all masks, and the share of each pixel that shows the object by
    alpha, mask files and background; None where these leave nothing out. of_files: that by alpha
    and mask files. silhouette: (h, w) bool, within `within_silhouette`."""
    title = thing("Photo", request.photo)
    inside, coverage = of_files >= 1, np.asarray(of_files, np.float32)
    background = background_of(request, problems)
    if background is not None:
        behind = background.pixels(reference)
        coverage = np.where(behind, np.float32(0), coverage)
        share = float(behind.mean())
        if share == 0:
            remarks.append(remark(title, "no pixel of it has the colour of its background"))
        inside = inside & ~behind
    shown = None if (coverage >= 1).all() else coverage
    if silhouette is not None:
        inside = inside & silhouette
    if inside.all():
        return weight, shown
    trimmed = eroded(inside, RIM)
    if not (weight * trimmed).any():
        if not (weight * inside).any():
            cause = "its masks together leave no pixel"
            problems.append(Problem(title, cause, "enlarge one of them, or leave the photo out"))
            return weight, shown
        remarks.append(remark(title, "its mask is so narrow that its rim counts too"))
        trimmed = inside
    return np.where(trimmed, weight, 0).astype(np.float32), shown


def eroded(inside: np.ndarray, count: int) -> np.ndarray:
    """(h, w) bool: pixels all of whose neighbours up to `count` pixels away are inside. Beyond the
    photo all is."""
    for _ in range(count):
        padded = np.pad(inside, 1, constant_values=True)
        height, width = inside.shape
        shifts = [padded[y : y + height, x : x + width] for y in range(3) for x in range(3)]
        inside = np.logical_and.reduce(shifts)
    return inside
