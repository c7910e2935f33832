# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench mutants`: which small faults the tests notice.

Each mutant of `bench/mutants/*.toml` is one change of a source. It is put into a copy of the
working tree, the tests that should fail are run there, and the table says whether they did. A
native mutant builds one program. Nothing is tried unless every old text is found exactly once and
the tests pass without a mutant. Status 1 if a mutant survives without a reason, or breaks the
build, or is caught although its row says why it cannot be.
"""

from __future__ import annotations

import argparse
import csv
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench"))

from mutants import catalogue  # noqa: E402
from mutants.catalogue import BadCatalogue, Mutant  # noqa: E402
from mutants.scratch import NotBuilt, Outcome, ScratchTree  # noqa: E402

PLACE = ROOT / "build" / "mutants"


@dataclass(frozen=True)
class Row:
    """Of the table."""

    mutant: Mutant
    outcome: Outcome
    seconds: float

    @property
    def is_right(self) -> bool:
        """Caught, or survived for a reason that is given."""
        return self.outcome.word == ("survived" if self.mutant.survives else "caught")

    def remark(self) -> str:
        """What catches it, or why it survives."""
        word, by = self.outcome.word, self.outcome.by
        if word == "caught":
            return f"{by}; remove its reason to survive" if self.mutant.survives else by
        if word == "survived":
            return self.mutant.survives or f"NOT NOTICED: {self.mutant.fault}"
        return by


def chosen(mutants: Sequence[Mutant], options: argparse.Namespace) -> list[Mutant]:
    """Those of --only, --python and --native; all without these."""
    found = [
        item
        for item in mutants
        if (not options.only or any(word in item.name for word in options.only))
        and (options.python == options.native or item.is_native == options.native)
    ]
    if not found:
        raise BadCatalogue("no mutant is called so; --list shows them all")
    return found


def tree_of(mutant: Mutant) -> ScratchTree:
    """Python's and native mutants have a tree each, so that both can be tried at once."""
    return ScratchTree(ROOT, PLACE / ("native" if mutant.is_native else "python"))


def prepare(mutant: Mutant, tree: ScratchTree) -> None:
    """Builds what its tests run."""
    if mutant.is_native:
        tree.build(f"{mutant.program}_tests" if mutant.program else mutant.module)


def check_unchanged(mutants: Sequence[Mutant], tree: ScratchTree) -> None:
    """The tests of the mutants pass without them, or the table would say nothing."""
    failed = []
    for item in together(mutants):
        prepare(item, tree)
        outcome = tree.test(item, tree.folder / "unchanged.log")
        what = item.program or ", ".join(item.tests)
        note(f"without a mutant: {what}: {outcome.word} {outcome.by}")
        if outcome.word != "survived":
            failed.append(f"{what}: {outcome.by}")
    if failed:
        raise NotBuilt("these tests fail without a mutant:\n" + "\n".join(failed))


def together(mutants: Sequence[Mutant]) -> list[Mutant]:
    """One that stands for all with the same file or program of tests: it runs the tests of all."""
    found: dict[tuple[str, str], Mutant] = {}
    for item in mutants:
        if item.program:
            known = found.setdefault(("gtest", item.program), item)
            if item.filter not in known.filter.split(":"):
                known = replace(known, filter=f"{known.filter}:{item.filter}")
            found["gtest", item.program] = known
        for name in item.tests:
            key = ("pytest", name.partition("::")[0])
            known = found.setdefault(key, replace(item, tests=(name,)))
            found[key] = replace(known, tests=tuple(dict.fromkeys((*known.tests, name))))
    return list(found.values())


def try_one(mutant: Mutant, tree: ScratchTree) -> Row:
    """Puts the mutant in, builds, tests, and takes it out again."""
    begun = time.monotonic()
    log = tree.folder / "logs" / f"{mutant.name}.log"
    log.parent.mkdir(parents=True, exist_ok=True)
    try:
        with tree.with_mutant(mutant):
            prepare(mutant, tree)
            outcome = tree.test(mutant, log)
    except NotBuilt as error:
        log.write_text(str(error))
        outcome = Outcome("broken", f"does not compile: {log}")
    return Row(mutant, outcome, time.monotonic() - begun)


def run(mutants: Sequence[Mutant], *, unchanged: bool) -> list[Row]:
    """A row for each mutant, in their order."""
    rows = []
    for native in (False, True):
        own = [item for item in mutants if item.is_native == native]
        if not own:
            continue
        tree = tree_of(own[0])
        with tree.alone():
            tree.refresh()
            if unchanged:
                check_unchanged(own, tree)
            for item in own:
                rows.append(try_one(item, tree))
                last = rows[-1]
                note(f"{last.outcome.word}: {item.name} ({last.seconds:.0f} s) {last.remark()}")
            for module in {item.module for item in own if item.is_native and item.tests}:
                tree.build(module)  # as it was
    return rows


def note(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def show(rows: Sequence[Row], place: Path) -> None:
    """The table on stdout and as a file."""
    place.parent.mkdir(parents=True, exist_ok=True)
    with place.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("name", "file", "fault", "outcome", "remark", "seconds"))
        for row in rows:
            item = row.mutant
            cells = (item.name, item.file, item.fault, row.outcome.word, row.remark())
            writer.writerow((*cells, f"{row.seconds:.1f}"))
    width = max(len(row.mutant.name) for row in rows)
    for row in rows:
        print(f"{row.mutant.name:<{width}}  {row.outcome.word:<8}  {row.remark()}")
    words = [row.outcome.word for row in rows]
    caught = words.count("caught")
    share = f"{caught} of {len(rows)} mutants caught ({caught / len(rows):.0%})"
    print(f"{share}, {words.count('survived')} survived, {words.count('broken')} broken; {place}")


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench mutants", description=__doc__)
    add = parser.add_argument
    add("--only", nargs="+", default=[], metavar="NAME", help="those whose name contains a word")
    add("--python", action="store_true", help="only those of Python sources")
    add("--native", action="store_true", help="only those of native sources")
    add("--list", action="store_true", help="name them, and check that all still apply")
    add("--trust", action="store_true", help="do not run the tests without a mutant first")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(130))  # takes the running tests along
    try:
        every = catalogue.load()
        mutants = chosen(every, options)
        faults = catalogue.unfit(every if options.list else mutants, ROOT)
        if faults:
            raise BadCatalogue("\n".join([*faults, "mend their rows in bench/mutants"]))
        if options.list:
            for item in mutants:
                print(f"{item.name}: {item.fault}")
            return 0
        rows = run(mutants, unchanged=not options.trust)
    except (BadCatalogue, NotBuilt) as error:
        print(error, file=sys.stderr)
        return 2
    show(rows, PLACE / "mutants.csv")
    return 0 if all(row.is_right for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
