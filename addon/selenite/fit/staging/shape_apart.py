# SPDX-License-Identifier: GPL-3.0-or-later
"""Vertices move while all else keeps its values: the stages of a fit of a shape and more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ... import parameters
from ...messages import remark, thing
from ...problems import listed
from ..field_kinds import kind_of
from .request import StageRequest

#: How often shape and the rest take turns where everything is fitted together; the same with an
#: image or colours of a surface, which compensate for a wrong shape; the share of a stage's
#: iterations that each turn, and the start, has; the fewest.
_TURNS, _TURNS_WITH_IMAGE, _SHARE, _FEWEST = 2, 4, 0.25, 5


def is_shape(name: str) -> bool:
    """Whether a name as `Ball:vertex_positions` is that of vertices."""
    kind = kind_of(name.rpartition(":")[2])
    return kind is not None and kind.is_shape


def apart(
    names: Sequence[str],
    stages: Sequence[StageRequest],
    iterations: int,
    warnings: list[str],
) -> tuple[StageRequest, ...]:
    """The stages of a fit of `names`, each of which moves vertices of one object or none; a warning
    names those that were added. The same where nothing else is fitted with vertices.

    Without stages: the rest for a short while, since a shape compensates for a wrong colour; each
    shape; the rest; then all in turns. Of a stage that has both: turns. With an image there are
    more turns and nothing before them, and the last of the rest has all iterations.
    """
    shapes = [name for name in names if is_shape(name)]
    rest = [name for name in names if not is_shape(name)]
    if not stages and (not shapes or len(names) == 1):
        return ()
    if stages:
        found = [part for stage in stages for part in _parts(stage, iterations)]
    elif _has_image(names):
        start = StageRequest("start of the rest", tuple(rest), _few(iterations))
        found = [start, *_turns(StageRequest("together", tuple(names), iterations), iterations)]
    else:
        first = [StageRequest(_title(name), (name,), iterations) for name in shapes]
        if rest:
            first.insert(0, StageRequest("start of the rest", tuple(rest), _few(iterations)))
            first.append(StageRequest("rest", tuple(rest), iterations))
        together = StageRequest("together", tuple(names), iterations)
        found = [*first, *_turns(together, iterations)]
    if len(found) != len(stages):
        text = "it moves while all else keeps its values; the stages are "
        warnings.append(
            remark(thing("Parameter", shapes[0]), text + listed([item.name for item in found]))
        )
    return tuple(found)


def _parts(stage: StageRequest, iterations: int) -> list[StageRequest]:
    shapes = [name for name in stage.parameters if is_shape(name)]
    if not shapes or len(stage.parameters) == 1:
        return [stage]
    return _turns(stage, iterations)


def _turns(stage: StageRequest, iterations: int) -> list[StageRequest]:
    """The rest comes last: its intervals are those at the final shape."""
    every = stage.iterations or iterations
    few, image = _few(every), _has_image(stage.parameters)
    turns = _TURNS_WITH_IMAGE if image else _TURNS
    rest = tuple(name for name in stage.parameters if not is_shape(name))
    found: list[tuple[str, tuple[str, ...]]] = []
    for turn in range(1, turns + 1):
        for name in stage.parameters:
            if is_shape(name):
                found.append((f"{stage.name} {turn}: {_title(name)}", (name,)))
        if rest:
            found.append((f"{stage.name} {turn}: rest", rest))
    parts = [replace(stage, name=name, parameters=own, iterations=few) for name, own in found]
    if image:
        parts[-1] = replace(parts[-1], iterations=every)
    return parts


def _has_image(names: Sequence[str]) -> bool:
    """Whether an image or colours of a surface are among them."""
    kinds = (kind_of(name.rpartition(":")[2]) for name in names)
    return any(kind is not None and kind.is_surface for kind in kinds)


def _few(iterations: int) -> int:
    return max(_FEWEST, round(_SHARE * iterations))


def _title(name: str) -> str:
    return f"shape of {parameters.split_name(name)[0]}"
