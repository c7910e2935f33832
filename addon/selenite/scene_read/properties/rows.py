# SPDX-License-Identifier: GPL-3.0-or-later
"""How the table of Blender's properties is written: rows of a type, each with its class.

To change the class of a property, change the word that its row begins with: a name moves from one
`no_effect("...")` to `modelled("...")`, or a `refused(...)` becomes `modelled("name")`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import cached_property, partial
from typing import Any

#: The value of a property, of any type that RNA has.
Value = Any
Acts = Callable[[Any, Any], bool]  # (block, Scope) -> whether the value can change the picture


class Effect(Enum):
    """The class of a property."""

    MODELLED = "modelled"
    NO_EFFECT = "no effect on radiance"
    REFUSED = "refused"
    WARNED = "warned of"


class By(Enum):
    """Who names a value that is not modelled."""

    TABLE = "judge"  # this package
    READER = "the reader that meets it"  # the modules of scene_read, with the place it is used at
    REMARK = "cycles_check.render_settings"  # settings that end, clamp or filter paths


@dataclass(frozen=True)
class OneOf:
    """Several values that the renderer takes as they are; the first is the usual one."""

    values: tuple[Value, ...]


@dataclass(frozen=True)
class Row:
    """Properties of one type that share a class.

    neutral: the value that the renderer takes for granted, stated here because neither the default
    in RNA nor that of a fresh datablock need be it. cause, cure: the sentence; {value}, {label} and
    {neutral} are filled in. covers: further properties that act only while this one is not neutral,
    so that naming this one names them. noise: it changes other random numbers only; what has no
    effect otherwise leaves every bit of a picture as it is (`./dev bench properties`).
    """

    names: tuple[str, ...]
    effect: Effect
    neutral: Value = None
    cause: str = ""
    cure: str = ""
    acts: Acts | None = None
    covers: tuple[str, ...] = ()
    by: By = By.TABLE
    noise: bool = False

    @property
    def every(self) -> tuple[str, ...]:
        """All names that the row knows."""
        return self.names + self.covers

    def is_neutral(self, value: Value) -> bool:
        """Whether the renderer takes `value` as it is."""
        wanted = self.neutral.values if isinstance(self.neutral, OneOf) else (self.neutral,)
        return any(same(value, item) for item in wanted)


@dataclass(frozen=True)
class Table:
    """The rows of one RNA type; those of its base types are in tables of their own.

    A row may name what only some versions of Blender have.
    """

    type: str
    rows: tuple[Row, ...]

    @cached_property
    def by_name(self) -> dict[str, Row]:
        """Every property that the table knows."""
        return {name: row for row in self.rows for name in row.every}

    @cached_property
    def named(self) -> tuple[Row, ...]:
        """The rows for which this package has to read values."""
        return tuple(row for row in self.rows if row.cause and row.by is not By.READER)


def table(type_name: str, *rows: Row) -> Table:
    """A table. Raises ValueError if a property is in it twice."""
    made = Table(type_name, rows)
    names = [name for row in rows for name in row.every]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ValueError(f"{type_name} lists twice: {', '.join(twice)}")
    return made


def modelled(names: str) -> Row:
    """What the reader reads, or what Blender has evaluated into what it reads."""
    return Row(tuple(names.split()), Effect.MODELLED)


def modelled_values(name: str, values: str) -> Row:
    """An enumeration of which all values are modelled, or named by a reader. A newer Blender may
    have another one, which is refused."""
    return Row(
        (name,),
        Effect.MODELLED,
        OneOf(tuple(values.split())),
        "{label} is {value}, which this version of Selenite does not know",
        "choose another",
    )


def no_effect(names: str) -> Row:
    """Names, the interface, the viewport, EEVEE: a picture is the same, bit by bit."""
    return Row(tuple(names.split()), Effect.NO_EFFECT)


def noise_only(names: str) -> Row:
    """What chooses how Cycles samples: the noise is another one, the expectation is not."""
    return Row(tuple(names.split()), Effect.NO_EFFECT, noise=True)


def _named(
    effect: Effect,
    name: str,
    neutral: Value,
    cause: str = "",
    cure: str = "",
    *,
    acts: Acts | None = None,
    covers: str = "",
) -> Row:
    return Row(
        (name,),
        effect,
        neutral,
        cause or "{label} is {value}, which is not modelled",
        cure or "set it to {neutral}",
        acts,
        tuple(covers.split()),
    )


#: The picture would be another one: a problem. Arguments as of `_named` behind the effect.
refused = partial(_named, Effect.REFUSED)
#: The picture may differ, and still means something: a warning.
warned = partial(_named, Effect.WARNED)


def refused_by_reader(names: str, covers: str = "") -> Row:
    """A reader refuses values that it does not model, where the property is used."""
    return Row(tuple(names.split()), Effect.REFUSED, covers=tuple(covers.split()), by=By.READER)


def warned_by_reader(names: str, covers: str = "") -> Row:
    """A reader warns of values that it does not model."""
    return Row(tuple(names.split()), Effect.WARNED, covers=tuple(covers.split()), by=By.READER)


def remarked(name: str, usual: Value = None, covers: str = "", *, worse: str = "") -> Row:
    """`cycles_check.render_settings` says what the setting costs, and can set it for a fit.

    usual: the factory setting. A scene that goes beyond it is warned of as well, since only its own
    pictures can be so: `worse` is "<", ">" or "!=".
    """
    acts: Acts | None = None
    if worse:
        beyond = {"<": operator.lt, ">": operator.gt, "!=": operator.ne}[worse]
        acts = lambda block, _: beyond(getattr(block, name), usual)  # noqa: E731
    return Row(
        (name,),
        Effect.WARNED,
        usual,
        "{label} is {value}: Cycles changes or leaves out light that the fit sees" if worse else "",
        "press Set Cycles for the Fit, or set it to {neutral} or better" if worse else "",
        acts,
        tuple(covers.split()),
        By.REMARK,
    )


def same(value: Value, other: Value) -> bool:
    """Equal, numbers within the rounding of 32 bits."""
    if isinstance(value, (bool, str)) or value is None or other is None:
        return bool(value == other)
    if isinstance(value, (int, float)):
        return isinstance(other, (int, float)) and math.isclose(
            value, other, rel_tol=1e-6, abs_tol=1e-9
        )
    if hasattr(value, "__len__") and hasattr(other, "__len__"):
        return len(value) == len(other) and all(map(same, value, other))
    return bool(value == other)
