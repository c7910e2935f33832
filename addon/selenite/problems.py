# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with the user's input, all of it at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Problem:
    """One thing that stops the work: which object, why, and what the user can do about it."""

    object: str
    cause: str
    cure: str

    def line(self) -> str:
        """The problem as one line of text."""
        return " ".join(f"{self.object}: {self.cause}; {self.cure}".split())

    def as_json(self) -> dict[str, str]:
        """Keys object, cause, cure."""
        return asdict(self)


class BadInput(Exception):
    """Exit status 2. Carries every problem that was found, not only the first."""

    def __init__(self, problems: Problem | Iterable[Problem]) -> None:
        self.problems = (
            [problems] if isinstance(problems, Problem) else list(dict.fromkeys(problems))
        )
        super().__init__("\n".join(problem.line() for problem in self.problems))


def listed(names: Iterable[str]) -> str:
    """Names for a message: 'A', 'B' or "none"."""
    return ", ".join(f"'{name}'" for name in names) or "none"
