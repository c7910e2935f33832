# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the user's input, all of it at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from typing import TYPE_CHECKING

from .messages import remark

if TYPE_CHECKING:
    from . import _core, _image


@dataclass(frozen=True)
class Problem:
    """One thing that stops the work: which object, why, and what the user can do about it. kind: by
    which the panel knows a button for the cure; "" where it has none."""

    object: str
    cause: str
    cure: str
    kind: str = ""

    def line(self) -> str:
        """The problem as one line of text."""
        plain = " ".join(self.object.split())
        about = self.object if self.object == plain else plain
        return remark(about, " ".join(f"{self.cause}; {self.cure}".split()))

    def as_json(self) -> dict[str, str]:
        """Keys object, cause, cure."""
        return {"object": self.object, "cause": self.cause, "cure": self.cure}


def problems_in(report: Mapping[str, object]) -> list[Problem]:
    """Those of the key "problems" of a report, see `Problem.as_json`."""
    found = report.get("problems")
    return [Problem(**item) for item in found] if isinstance(found, list) else []


class Reason(str):
    """Why something cannot be, as "cause: cure"; empty where it can."""

    __slots__ = ("cause", "cure")
    cause: str
    cure: str

    def __new__(cls, cause: str = "", cure: str = "") -> Reason:
        """cure: "" where nothing helps."""
        self = super().__new__(cls, f"{cause}: {cure}" if cure else cause)
        self.cause, self.cure = cause, cure
        return self

    def __reduce__(self) -> tuple[type[Reason], tuple[str, str]]:
        """For copies and other processes."""
        return Reason, (self.cause, self.cure)

    def after(self, words: str) -> Reason:
        """The same, with `words` before its cause."""
        return Reason(f"{words}{self.cause}", self.cure) if self else self

    def problem(self, title: str, cure: str) -> Problem:
        """Of `title`; `cure` where there is no other."""
        return Problem(title, self.cause, self.cure or cure)


class BadInput(Exception):
    """Exit status 2. Carries every problem that was found, not only the first."""

    def __init__(self, problems: Problem | Iterable[Problem]) -> None:
        self.problems = (
            [problems] if isinstance(problems, Problem) else list(dict.fromkeys(problems))
        )
        super().__init__("\n".join(problem.line() for problem in self.problems))


class NotWritten(BadInput):
    """A file that its disk or a quota does not take, whose name is good. Exit status 1."""


class Failed(RuntimeError):
    """Work that came to no end, for a reason that is a sentence for the user. Exit status 1."""


def listed(names: Iterable[str]) -> str:
    """Names for a message: 'A', 'B' or "none"."""
    return ", ".join(f"'{name}'" for name in names) or "none"


def choice(wrong: str, names: Iterable[str]) -> str:
    """The cure for a name that is none of `names`: the one with nearly its spelling, and all."""
    known = list(names)
    return f"{meant(wrong, known)}use one of {listed(known)}"


def meant(wrong: str, names: Iterable[str]) -> str:
    """A question about the name with nearly its spelling, and a space; "" where there is none."""
    written = {name.casefold(): name for name in names}
    near = get_close_matches(wrong.casefold(), written, n=1)
    return f"did you mean '{written[near[0]]}'? " if near else ""


@contextmanager
def refused(title: str, cure: str) -> Iterator[None]:
    """What a native module refuses inside becomes BadInput; `title` and `cure` stand in for what it
    does not say."""
    try:
        yield
    except (ValueError, KeyError) as error:
        raise BadInput(
            Problem(said.object or title, said.cause, said.cure or cure)
            for said in native_problems(error)
        ) from error


def native_problems(error: Exception) -> Sequence[_core.Problem | _image.Problem | Problem]:
    """What an error of a native module carries; of another error, its text."""
    text = str(error.args[0] if isinstance(error, KeyError) and error.args else error)
    return getattr(error, "problems", None) or [Problem("", text or type(error).__name__, "")]
