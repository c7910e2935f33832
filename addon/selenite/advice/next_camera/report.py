# SPDX-License-Identifier: GPL-3.0-or-later
"""A suggestion in words, as a table and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...capture.light_states import described, is_as_in_scene
from .candidates import Candidate
from .suggestion import Row, Suggestion

if TYPE_CHECKING:
    from ...json_text import JsonObject

#: Name of the camera object that is made.
NEW_CAMERA = "Next photo"
#: An error that shrinks less is not worth a word; a gain below is no gain (mean logarithm).
_WORTH, _LEAST_GAIN = 0.85, 0.05
#: Degrees within which a direction has no side, or no height.
_STRAIGHT, _LEVEL = 8, 3


def where(place: Candidate, first: str) -> str:
    """As in "90° to the right of 'Front', 38° up", or the name of a camera that is there."""
    if place.existing:
        return f"camera '{place.camera.name}'"
    side = abs(place.azimuth)
    if place.elevation > 80:
        return "from straight above"
    if side <= _STRAIGHT:
        text = f"from the side of '{first}'"
    elif side >= 180 - _STRAIGHT:
        text = f"from behind, opposite '{first}'"
    else:
        text = f"{side:.0f}° to the {'right' if place.azimuth > 0 else 'left'} of '{first}'"
    if abs(place.elevation) <= _LEVEL:
        return f"{text}, level"
    return f"{text}, {abs(place.elevation):.0f}° {'up' if place.elevation > 0 else 'down'}"


def changes(found: Suggestion, row: Row) -> list[str]:
    """What a photo from there does for each parameter, where it does something."""
    lines = []
    for item, group in zip(found.plan.unknowns, found.groups, strict=True):
        factor = _factor(found, row, group)
        was, will = found.known[group].all(), row.known[group].all()
        if will and not was:
            lines.append(f"determines {item.name}")
        elif factor <= _WORTH:
            lines.append(_shrinks(item.name, factor))
    return lines


def advice(found: Suggestion) -> list[str]:
    """The answer in sentences: where, what for, and what no place determines. `rows` must be
    there."""
    best, first = found.rows[0], found.plan.captures[0].camera
    place = where(best.candidate, first)
    if best.gain < _LEAST_GAIN:
        lines = [
            f"No place adds much to the photos: the best, {place}, shrinks the errors "
            f"by {100 * (1 - math.exp(-best.gain)):.0f} %; another light may, or a fixed value "
            "for a parameter that others compensate for"
        ]
    else:
        lines = [
            f"Next photo: {place}; it {', '.join(changes(found, best)) or 'helps all a little'}"
        ]
    if found.well_known:
        lines.append("All values are known within a hundredth of their range already")
    if best.gain <= found.repeated:
        lines.append(f"Another photo from '{first}' itself would add as much")
    if not all(is_as_in_scene(item.lights) for item in found.plan.captures):
        lines.append(f"The lights of a next photo are taken as in most: {described(found.lights)}")
    left = [
        item.name
        for item, group in zip(found.plan.unknowns, found.groups, strict=True)
        if not best.known[group].all()
    ]
    if left:
        lines.append(
            f"Not determined even then: {', '.join(left)}; another light, or a fixed value for "
            "what compensates for it"
        )
    return lines


def table_rows(found: Suggestion) -> tuple[list[str], list[list[str]]]:
    """(titles, a row for each place, the best first) for the terminal."""
    first = found.plan.captures[0].camera
    titles = ["place", "position", "errors", *(item.name for item in found.plan.unknowns)]
    rows = [["now", "", "", *_errors(found, found.errors, found.known)]]
    for row in found.rows:
        position = " ".join(f"{x:.2f}" for x in row.candidate.position)
        factor = f"x {math.exp(-row.gain):.2f}"
        errors = _errors(found, row.errors, row.known)
        rows.append([where(row.candidate, first), position, factor, *errors])
    return titles, rows


def as_json(found: Suggestion) -> JsonObject:
    """All of it; errors are lists by component for a colour and null where not determined."""
    first = found.plan.captures[0].camera
    places = []
    for row in found.rows:
        place = row.candidate
        places.append({
            "where": where(place, first),
            "camera": place.camera.name if place.existing else None,
            "azimuth": place.azimuth,
            "elevation": place.elevation,
            "position": place.position.tolist(),
            "matrix": place.camera.matrix.tolist(),
            "gain": row.gain,
            "errors_shrink_to": math.exp(-row.gain),
            "parameters": {
                item.name: {
                    "standard_error": _shown(row.errors[group], row.known[group]),
                    "determined": bool(row.known[group].all()),
                    "shrinks_to": _factor(found, row, group),
                }
                for item, group in zip(found.plan.unknowns, found.groups, strict=True)
            },
        })  # fmt: skip
    return {
        "object": found.body.names,
        "photos": [item.id for item in found.plan.captures],
        "parameters": {
            item.name: {
                "value": _plain(item.start),
                "standard_error": _shown(found.errors[group], found.known[group]),
                "determined": bool(found.known[group].all()),
                "unit": item.parameter.unit,
            }
            for item, group in zip(found.plan.unknowns, found.groups, strict=True)
        },
        "lights": described(found.lights),
        "same_photo_again_shrinks_to": math.exp(-found.repeated),
        "advice": advice(found),
        "places": places,
        "seconds": found.seconds,
    }


def _factor(found: Suggestion, row: Row, group: Sequence[int]) -> float:
    """By which the errors of a parameter's components shrink, geometric mean."""
    ratios = row.errors[list(group)] / found.errors[list(group)]
    return float(np.exp(np.mean(np.log(ratios))))


def _shrinks(name: str, factor: float) -> str:
    if 0.45 <= factor <= 0.55:
        return f"halves the uncertainty of {name}"
    return f"shrinks the uncertainty of {name} to {100 * factor:.0f} %"


def _errors(found: Suggestion, errors: np.ndarray, known: np.ndarray) -> list[str]:
    """A cell for each parameter; the largest of a colour's."""
    return [
        f"{errors[group].max():.3g}" if known[group].all() else "not determined"
        for group in found.groups
    ]


def _shown(errors: np.ndarray, known: np.ndarray) -> float | list[float | None] | None:
    return _plain([float(e) if ok else None for e, ok in zip(errors, known, strict=True)])


def _plain(values: Sequence[float | None]) -> float | list[float | None] | None:
    return values[0] if len(values) == 1 else list(values)
