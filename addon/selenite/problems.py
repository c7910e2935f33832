# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the user's input, all of it at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches


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
        return " ".join(f"{self.object}: {self.cause}; {self.cure}".split())

    def as_json(self) -> dict[str, str]:
        """Keys object, cause, cure."""
        return {"object": self.object, "cause": self.cause, "cure": self.cure}


def problems_in(report: Mapping[str, object]) -> list[Problem]:
    """Those of the key "problems" of a report, see `Problem.as_json`."""
    found = report.get("problems")
    return [Problem(**item) for item in found] if isinstance(found, list) else []


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


def problems_of(error: Exception, title: str, cure: str) -> list[Problem]:
    """What the native module refuses, a problem for each line of it, read as "object: cause; cure";
    `title` and `cure` stand in for what a line does not say."""
    text = str(error.args[0]) if error.args else type(error).__name__
    found = []
    for line in text.splitlines():
        name, colon, rest = line.partition(": ")
        if not colon or ";" in name:
            name, rest = title, line
        cause, _, own = rest.partition("; ")
        found.append(Problem(name, cause, own or cure))
    return found or [Problem(title, "it is refused", cure)]


@contextmanager
def refused(title: str, cure: str) -> Iterator[None]:
    """What the native module refuses inside becomes BadInput; see `problems_of`."""
    try:
        yield
    except (ValueError, KeyError) as error:
        raise BadInput(problems_of(error, title, cure)) from error
