# SPDX-License-Identifier: GPL-3.0-or-later
"""Light where an opaque body has none: in places that the renders leave dark, photos are bright.

A body that lets light through shows it there; so does light that the scene lacks. Which of the two
it is, no picture tells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...capture.views import View, blurred, eroded
from ...messages import message

#: Of the bright level, the brightness that this share of all pixels stays below: what is dark.
_BRIGHT, _DARK = 0.9, 0.2
#: Pixels from the edge of a shadow, where a camera or a lamp that is a little off matters.
_OFF_EDGE = 2
#: Pixels of a photo, photos, standard errors, of the bright level, and times the render's light.
_FEWEST_PIXELS, _FEWEST_PHOTOS, _SIGMAS, _EXCESS, _TIMES = 20, 3, 3.0, 0.05, 2.0


def is_lit_in_the_dark(views: Sequence[View]) -> bool | None:
    """Whether light is where an opaque body has none; None: too few photos have dark places."""
    excess, brighter = _excess(views)
    return None if len(excess) < _FEWEST_PHOTOS else brighter and _stands_out(excess)


def light_in_the_dark(views: Sequence[View]) -> list[str]:
    """No sentence or one, of the renders that a fit of opaque bodies ends with."""
    if not is_lit_in_the_dark(views):
        return []
    excess, _ = _excess(views)
    return [
        message(
            "unlit.photos-their-bright-level",
            "{count} of {all} photos are {share} of their bright level brighter "
            "in places that the render leaves dark: light comes through the body, or "
            "light of the room is missing. Fit subsurface scattering or a"
            " medium (see Volumes in the manual), or World:strength",
            count=len(excess),
            all=len(views),
            share=f"{np.mean(excess):.0%}",
        )
    ]


def _stands_out(excess: Sequence[float]) -> bool:
    mean, error = float(np.mean(excess)), float(np.std(excess, ddof=1)) / math.sqrt(len(excess))
    return mean >= max(_EXCESS, _SIGMAS * error)


def _excess(views: Sequence[View]) -> tuple[list[float], bool]:
    """How much brighter each photo with dark places is there, in bright levels; whether all of them
    together are much brighter."""
    counted = [view.weight > 0 for view in views]
    photos = [view.reference.mean(axis=2, dtype=float) for view in views]
    if not any(inside.any() for inside in counted):
        return [], False
    bright = float(
        np.quantile(
            np.concatenate([p[inside] for p, inside in zip(photos, counted, strict=True)]), _BRIGHT
        )
    )
    excess, seen, shown = [], 0.0, 0.0
    for view, inside, photo in zip(views, counted, photos, strict=True):
        render = blurred(view.picture).mean(axis=2)  # a pixel may be dark by chance
        dark = eroded(inside & (render < _DARK * bright), _OFF_EDGE)
        if dark.sum() < _FEWEST_PIXELS:
            continue
        excess.append(float((photo - render)[dark].mean()) / bright)
        seen, shown = seen + float(photo[dark].sum()), shown + float(render[dark].sum())
    return excess, seen >= _TIMES * shown
