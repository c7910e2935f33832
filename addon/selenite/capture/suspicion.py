# SPDX-License-Identifier: GPL-3.0-or-later
"""A background that a photo has in place of the scene's, and that counts for want of a mask."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import native
from ..messages import message
from .background import Background, border
from .prepared import Capture
from .silhouette import Silhouettes

if TYPE_CHECKING:
    from .._core import Scene

#: Largest difference of one colour in sRGB code values: what compression leaves.
_EVEN = 0.02
#: The least share of the photo, and of its border, that such a background takes, and the largest:
#: beyond it is a photo of nothing else.
_LEAST, _LEAST_BORDER, _MOST = 0.05, 0.25, 0.95
#: Rows and samples of the render beside it.
_ROWS, _SPP, _SEED = 48, 32, 1 << 43
#: Linear light that is black, and how much brighter than it the scene has to be. Of another colour:
#: by which factor the scene has to differ.
_BLACK, _BRIGHTER, _OTHER = 0.01, 4.0, 1.5


def remark(
    capture: Capture,
    scene: Scene,
    silhouettes: Silhouettes,
    depth: int,
    threads: int,
    *,
    black_only: bool = False,
) -> str:
    """A warning if pixels of one colour join the photo's border, count, and the scene renders
    something else there that is not fitted; "" if not. black_only: light or gain are fitted, so no
    other brightness tells."""
    behind = Background(None, _EVEN).pixels(capture.reference) & (capture.weight > 0)
    rim = border(behind.shape)
    if not _LEAST <= behind.mean() <= _MOST or behind[rim].mean() < _LEAST_BORDER:
        return ""
    height, width = behind.shape
    rows = min(_ROWS, height)
    columns = max(1, round(width * rows / height))
    small = native.image().resize(behind.astype(np.float32), columns, rows) > 1 - 1e-4
    frame = capture.frame_of_render
    small &= silhouettes.coverage(capture.camera, frame, (columns, rows)) == 0
    if not small.any():
        return ""
    seen = native.core().Evaluator(scene, depth=depth, threads=threads)
    film = seen.picture(capture.view((columns, rows), of_file=False), _SPP, seed=_SEED)
    photo = float(np.median(capture.reference[behind].mean(axis=-1)))
    render = float(np.median(film.image[small].mean(axis=-1)))
    if photo < _BLACK:
        differs = render > _BLACK and render > _BRIGHTER * photo
    else:
        differs = not black_only and not photo / _OTHER <= render <= photo * _OTHER
    if not differs:
        return ""
    what = (
        "black"
        if photo < _BLACK
        else message("suspicion.one-brightness", "of one brightness, {photo}", photo=f"{photo:.2g}")
    )
    return message(
        "suspicion.photo-up-border-scene",
        "Photo '{photo}': {mean} of it, up to its border, is {what}, and the "
        "scene renders {render} there: that background counts; give a mask, "
        "'silhouette', or 'background': \"border\"",
        photo=capture.photo,
        mean=f"{behind.mean():.0%}",
        what=what,
        render=f"{render:.2g}",
    )
