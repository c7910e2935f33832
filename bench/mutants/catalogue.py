# SPDX-License-Identifier: GPL-3.0-or-later
"""The mutants: tables of `*.toml` beside this file, and whether they still fit the sources."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent


class BadCatalogue(RuntimeError):
    """The tables are wrong, or no longer fit the sources; a line for each fault."""


@dataclass(frozen=True)
class Mutant:
    """One fault: in `file`, `old` (found exactly once) becomes `new`.

    fault: what a user would notice. tests: files or test ids of pytest that should fail. program
    and filter: of GoogleTest, in place of `tests`. module: what pytest's tests of a native file
    load. survives: why no test notices it; "" for a mutant that has to be caught.
    """

    name: str
    file: str
    old: str
    new: str
    fault: str
    tests: tuple[str, ...] = ()
    program: str = ""
    filter: str = ""
    module: str = "_core"
    survives: str = ""

    @property
    def is_native(self) -> bool:
        """Whether something has to be compiled."""
        return self.file.startswith("native/")


def load(folder: Path = FOLDER) -> list[Mutant]:
    """The mutants of all tables. Raises BadCatalogue."""
    found: list[Mutant] = []
    faults: list[str] = []
    for path in sorted(folder.glob("*.toml")):
        for number, row in enumerate(tomllib.loads(path.read_text())["mutant"], start=1):
            made = _mutant(row, f"{path.name}, mutant {number}", faults)
            found += [made] if made is not None else []
    names = [item.name for item in found]
    twice = sorted({name for name in names if names.count(name) > 1})
    faults += [f"mutant '{name}' is there twice" for name in twice]
    if faults:
        raise BadCatalogue("\n".join(faults))
    return found


def _mutant(row: dict[str, Any], place: str, faults: list[str]) -> Mutant | None:
    known = {field.name for field in fields(Mutant)}
    place = f"{place} ('{row.get('name', 'without a name')}')"
    unknown = sorted({*row} - known)
    missing = [key for key in ("name", "file", "old", "new", "fault") if key not in row]
    faults += [f"{place}: key '{key}' is not known" for key in unknown]
    faults += [f"{place}: key '{key}' is missing" for key in missing]
    if unknown or missing:
        return None
    made = Mutant(**row | {"tests": tuple(row.get("tests", ()))})
    if bool(made.tests) == bool(made.program):
        faults.append(f"{place}: give either tests or program and filter")
    if bool(made.program) != bool(made.filter):
        faults.append(f"{place}: program and filter belong together")
    if made.old == made.new:
        faults.append(f"{place}: old and new are equal")
    return made


def unfit(mutants: list[Mutant], root: Path) -> list[str]:
    """What keeps the mutants from being tried on the sources under `root`, a line each."""
    found = []
    for item in mutants:
        path = root / item.file
        count = path.read_text(encoding="utf-8").count(item.old) if path.is_file() else -1
        if count < 0:
            found.append(f"{item.name}: there is no file {item.file}")
        elif count != 1:
            found.append(f"{item.name}: its old text is {count} times in {item.file}, not once")
        for test in item.tests:
            if not (root / test.partition("::")[0]).is_file():
                found.append(f"{item.name}: there is no test {test}")
    return found
