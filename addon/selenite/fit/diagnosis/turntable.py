# SPDX-License-Identifier: GPL-3.0-or-later
"""A body on a turntable: its cameras were placed around it, and its light came along.

Seen from the cameras the bright side of such photos is always the same; under lights that stand
still it goes round with the camera.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...capture.views import View
from ...messages import message

#: Photos at least; mean direction of the cameras, from 0 all around to 1 all on one side, at most.
_FEWEST, _AROUND = 5, 0.6
#: Of the bright side: how far it lies to one side, of the body's half width; standard errors; and
#: its scatter from photo to photo over that.
_TO_ONE_SIDE, _SIGMAS, _SCATTER = 0.04, 4.0, 0.7
#: How much farther the bright side of the renders scatters, which the scene's lights make.
_RENDERS = 1.5


def light_turns(views: Sequence[View], azimuths: Mapping[str, float]) -> list[str]:
    """No sentence or one. azimuths: by photo the angle of its camera around the vertical axis, of
    photos under one light state."""
    known = [view for view in views if view.id in azimuths and (view.weight > 0).any()]
    if len(known) < _FEWEST or _concentration([azimuths[view.id] for view in known]) > _AROUND:
        return []
    seen = np.array([bright_side(view.reference, view.weight) for view in known])
    shown = np.array([bright_side(view.picture, view.weight) for view in known])
    mean, scatter = abs(float(seen.mean())), float(seen.std(ddof=1))
    error = scatter / math.sqrt(len(known))
    constant = mean > _TO_ONE_SIDE and mean > _SIGMAS * error and scatter < _SCATTER * mean
    of_renders = float(shown.std(ddof=1))
    explained = abs(float(shown.mean())) > mean / 2 and of_renders <= _RENDERS * scatter
    if not constant or explained:
        return []
    side = "right" if seen.mean() > 0 else "left"
    return [
        message(
            "turntable.side-bright-one-photos",
            "The {side} side is the bright one in {count} photos from all around: "
            "the light turned with the camera, as on a turntable, and that of the "
            "scene stands still. Give each photo the places of its lamps (see "
            "Lights of Captures in the manual)",
            side=side,
            count=len(known),
        )
    ]


def bright_side(picture: np.ndarray, weight: np.ndarray) -> float:
    """How far the middle of the light lies to the right of the middle of what counts, of its half
    width."""
    inside = weight > 0
    columns = np.arange(inside.shape[1], dtype=float)
    of_column = inside.sum(axis=0).astype(float)
    light = np.where(inside, picture.mean(axis=2, dtype=float), 0).clip(0).sum(axis=0)
    if not light.sum() > 0:
        return 0.0
    middle = float(columns @ of_column / of_column.sum())
    spread = math.sqrt(float(np.square(columns - middle) @ of_column / of_column.sum()))
    return (float(columns @ light / light.sum()) - middle) / max(2 * spread, 1.0)


def _concentration(angles: Sequence[float]) -> float:
    """Length of the mean of directions."""
    return float(abs(np.exp(1j * np.asarray(angles)).mean()))
