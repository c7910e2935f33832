# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknowns on surfaces, and which of their places the photos see."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import native
from ...capture.prepared import Capture
from ...problems import BadInput, Problem, listed
from ..request import UnknownRequest
from .base import FieldUnknown

if TYPE_CHECKING:
    from ..._core import Scene

UNSEEN = ("keep", "fill")
#: Samples of a pixel that tell the coverage, and the share of the usual place's below which a texel
#: or vertex counts as not seen: what steps of a fit do to it is noise for the most part
#: (docs/measurements/fields.md).
_COVERAGE_SPP, _HARDLY_SEEN = 4, 0.1


@dataclass(frozen=True, eq=False)
class SurfaceUnknown(FieldUnknown):
    """An image of a material, or the colours of a mesh. `unseen`: what becomes of the places that
    no photo sees, see UnknownRequest."""

    unseen: str

    @abstractmethod
    def completed(self, values: np.ndarray, known: np.ndarray) -> np.ndarray:
        """The values with those at places that are not known filled from around them."""

    @staticmethod
    def share_seen(coverage: np.ndarray | None) -> dict[str, object]:
        """For result.json: the share of the places that the photos see."""
        return {} if coverage is None else {"seen": float(seen(coverage).mean())}


def unseen_of(request: UnknownRequest, has_own: bool, title: str) -> str:
    """What becomes of places that no photo sees; has_own: the start says something of each. Raises
    BadInput."""
    if request.unseen not in ("", *UNSEEN):
        cause = f"what becomes of unseen texels is '{request.unseen}'"
        raise BadInput(Problem(title, cause, f"give {listed(UNSEEN)}"))
    return request.unseen or ("keep" if has_own else "fill")


def coverage(field: SurfaceUnknown, scene: Scene, captures: Sequence[Capture]) -> np.ndarray:
    """One float32 a place, (h, w) or (n,): what all photos, pixels weighted as they count, change
    by
    with it.

    scene: native, with the field. The sum over the photos of the derivative of each one's mean.
    """
    total = np.zeros(field.values.shape[:-1])
    evaluator = native.core().Evaluator(scene)
    for item in captures:
        _, places = evaluator.gradient(
            item.native(), field.owner, field.kind.parameter, _COVERAGE_SPP
        )
        total += np.abs(places).mean(axis=-1)
    return total.astype(np.float32)


def seen(found: np.ndarray) -> np.ndarray:
    """Bool of each place: whether photos tell something of it."""
    return found > _HARDLY_SEEN * usual_coverage(found)


def usual_coverage(found: np.ndarray) -> float:
    """Of a place that is seen; 0 where none is."""
    positive = found[found > 0]
    return float(np.median(positive)) if positive.size else 0.0


def finished(
    fields: Sequence[FieldUnknown],
    arrays: Mapping[str, np.ndarray],
    scene: Scene,
    captures: Sequence[Capture],
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """(fields with what no photo sees kept or filled, coverage of those on surfaces), both by name.

    arrays: the fitted fields by name. scene: native, with them.
    """
    final, found = dict(arrays), {}
    wanted = [item for item in fields if isinstance(item, SurfaceUnknown)]
    for index, item in enumerate(wanted):
        progress(f"what the photos see of {item.name}", index / len(wanted))
        found[item.name] = coverage(item, scene, captures)
        known = seen(found[item.name])
        if item.unseen == "fill":
            final[item.name] = item.completed(arrays[item.name], known)
        else:
            final[item.name] = np.where(known[..., None], arrays[item.name], item.values)
    return final, found
