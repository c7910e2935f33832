# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench golden [REV]`: the working tree against a revision, bit by bit.

Both run the same small commands (`golden/cases.py`) on the same scenes and photos, which the
revision renders. All results and pictures are compared but times, places and versions, under names
that may have changed (`golden/renamed.py`). Interrupted fits go on in the working tree and are
compared with those of the revision that nobody stopped. Status 1 if one differs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

import numpy as np  # noqa: E402
from golden import cases, compare, revision  # noqa: E402
from golden.cases import Case  # noqa: E402
from golden.revision import Revision  # noqa: E402

from selenite import native  # noqa: E402

_SOURCES = ROOT / "bench" / "golden"
_LIMIT = 1200  # seconds for a process of commands
_WORK = ("samples", "dropped")  # keys of result.json that count paths


@dataclass(frozen=True)
class Row:
    """Of the table: seconds before and now (0: not run by itself), difference ("": equal), and a
    remark on what is equal."""

    name: str
    seconds: tuple[float, float]
    difference: str
    remark: str = ""


def run_commands(of: Revision, commands: list[dict[str, Any]], log: Path, **job: Any) -> None:
    """All of them in one process, or in another one behind each that crashed; each leaves its
    folder, where done.json is missing after a crash."""
    while commands:
        for command in commands:
            shutil.rmtree(command["folder"], ignore_errors=True)
        description = of.folder / "job.json"
        content = {"package": str(of.package), "commands": commands, **job}
        description.write_text(json.dumps(content), encoding="utf-8")
        words = [sys.executable, str(_SOURCES / "run_cases.py"), str(description)]
        environment = os.environ | {"PYTHONPATH": str(of.package.parent)}
        with log.open("ab") as file:
            subprocess.run(
                words, env=environment, stdout=file, stderr=file, timeout=_LIMIT, check=False
            )
        ended = [(Path(item["folder"]) / "done.json").is_file() for item in commands]
        if all(ended):
            return
        commands, job = commands[ended.index(False) + 1 :], {}


def make_inputs(of: Revision) -> Path:
    """Scenes, photos and other files that the cases name, as the revision renders them."""
    inputs = of.folder / "inputs"
    parts = [(_SOURCES / "scenes.py").read_text(), repr(cases.PHOTOS), repr(cases.FILES)]
    key = hashlib.sha256("\n".join(parts).encode()).hexdigest()
    stamp = inputs / "key"
    if stamp.is_file() and stamp.read_text() == key:
        return inputs
    shutil.rmtree(inputs, ignore_errors=True)
    inputs.mkdir(parents=True)
    log = of.folder / "inputs.log"
    with log.open("wb") as file:
        subprocess.run(
            [sys.executable, str(_SOURCES / "scenes.py"), str(inputs)], stdout=file, stderr=file,
            timeout=_LIMIT, check=True,
        )  # fmt: skip
    for name, content in cases.FILES.items():
        (inputs / name).write_text(json.dumps(content), encoding="utf-8")
    commands = [
        {"name": f"photo {p.name}", "words": p.words(str(inputs)), "folder": str(inputs / p.name)}
        for p in cases.PHOTOS
    ]
    run_commands(of, commands, log, mask=str(inputs))
    missing = [p.name for p in cases.PHOTOS if not (inputs / f"{p.name}.exr").is_file()]
    if missing:
        raise revision.NotBuilt(f"photos {missing} were not rendered: see {log}")
    stamp.write_text(key)
    return inputs


def _command(case: Case, folder: Path, inputs: Path, interrupted: Sequence[str]) -> dict[str, Any]:
    words = [word.format(inputs=inputs, folder=folder) for word in case.words]
    return case.as_json() | {"words": words, "folder": str(folder), "interrupted": interrupted}


def run_before(of: Revision, wanted: Sequence[Case], inputs: Path) -> None:
    """Cases of the older revision, but those whose results are there already."""
    stale = []
    for case in wanted:
        folder = of.folder / "results" / case.name
        command = _command(case, folder, inputs, ())
        key = json.dumps([command, (inputs / "key").read_text()], sort_keys=True)
        stamp = folder.with_name(f"{case.name}.key")
        if not (folder / "done.json").is_file() or not stamp.is_file() or stamp.read_text() != key:
            stale.append(command)
            stamp.parent.mkdir(parents=True, exist_ok=True)
            stamp.write_text(key)
    run_commands(of, stale, of.folder / "cases.log")


def run_now(of: Revision, wanted: Sequence[Case], inputs: Path) -> None:
    """Cases of the working tree, and the rest of those that were interrupted."""
    of.folder.mkdir(parents=True, exist_ok=True)
    results, log = of.folder / "results", of.folder / "cases.log"
    log.unlink(missing_ok=True)
    commands = [_command(case, results / case.name, inputs, case.interrupted) for case in wanted]
    run_commands(of, commands, log)
    resumed = []
    for case in wanted:
        for phase in case.interrupted:
            run = results / case.name / "interrupted" / phase / "run.unfinished"
            folder = results / f"{case.name}, {phase}"
            shutil.rmtree(folder, ignore_errors=True)
            if run.is_dir():
                resumed.append({
                    "name": folder.name, "words": ["fit", f"--resume={run}"],
                    "folder": str(folder), "settings": case.settings,
                })  # fmt: skip
    run_commands(of, resumed, log)


def _done(folder: Path) -> dict[str, Any]:
    path = folder / "done.json"
    if not path.is_file():
        log = folder.parents[1] / "cases.log"
        return {"seconds": 0.0, "status": 1, "error": f"it came to no end: {log}", "copied": {}}
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def _read_picture(path: str) -> np.ndarray:
    pixels, alpha, _ = native.image().read(path, as_linear=False)
    return pixels if alpha is None else np.dstack([pixels, alpha])


def _row(name: str, before: Path, now: Path, resumed: bool = False) -> Row:
    """A phase that begins again counts its paths twice: in `resumed` that is a remark."""
    one, other = _done(before), _done(now)
    seconds = (0.0 if resumed else one["seconds"], other["seconds"])
    for which, done in (("before", one), ("now", other)):
        if done["status"]:
            return Row(name, seconds, f"{which} status {done['status']}: {done.get('error', '')}")
    found = compare.difference(before, now, _read_picture)
    if found and resumed:
        rest = compare.difference(before, now, _read_picture, left_out=_WORK)
        return Row(name, seconds, rest, f"equal, but {found}")
    return Row(name, seconds, found)


def rows(before: Revision, now: Revision, wanted: Sequence[Case]) -> list[Row]:
    """One for each case, and for each phase in which it was interrupted."""
    found = []
    old, new = before.folder / "results", now.folder / "results"
    for case in wanted:
        found.append(_row(case.name, old / case.name, new / case.name))
        copied = _done(new / case.name)["copied"]
        for phase in case.interrupted:
            name = f"{case.name}, {phase}"
            if phase not in copied:
                found.append(Row(name, (0.0, 0.0), "the fit was never seen in that phase"))
                continue
            said, iterations = copied[phase]
            label = f"{name} at {iterations}" + ("" if said == phase else f", said to be {said}")
            found.append(_row(label, old / case.name, new / name, resumed=True))
    return found


def show(found: Sequence[Row]) -> None:
    """Row by row; a difference is cut to what a line holds."""
    width = max(len(row.name) for row in found)
    print(f"\n{'case':<{width}}  before  now (s)")
    for row in found:
        seconds = "".join(f"{s:7.1f}" if s else f"{'-':>7}" for s in row.seconds)
        print(f"{row.name:<{width}} {seconds}   {row.difference[:600] or row.remark or 'equal'}")


def chosen(options: argparse.Namespace) -> list[Case]:
    """By --only (parts of names) and --without (groups). Raises SystemExit for an unknown one."""
    names = {case.name for case in cases.CASES}
    groups = {case.group for case in cases.CASES if case.group}
    for part in options.only:
        if not any(part in name for name in names):
            raise SystemExit(f"no case has '{part}' in its name; --list shows them")
    for group in set(options.without) - groups:
        raise SystemExit(f"there is no group '{group}', only {', '.join(sorted(groups))}")
    return [
        case
        for case in cases.CASES
        if case.group not in options.without
        and (not options.only or any(part in case.name for part in options.only))
    ]


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench golden", description=__doc__)
    parser.add_argument("revision", nargs="?", default="HEAD~1", metavar="REV")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="parts of names")
    parser.add_argument("--without", nargs="+", default=[], metavar="GROUP")
    parser.add_argument("--list", action="store_true", help="names and groups of the cases")
    keep = "keeps the build and the results of REV under build/golden for the next time"
    parser.add_argument("--keep", action="store_true", help=keep)
    options = parser.parse_args()
    wanted = chosen(options)
    if options.list:
        for case in wanted:
            print(case.name + (f"  [{case.group}]" if case.group else ""))
        return 0
    begin = time.monotonic()
    before, now = revision.checked_out(options.revision), revision.working_tree()
    built = time.monotonic() - begin
    inputs = make_inputs(before)
    run_before(before, wanted, inputs)
    run_now(now, wanted, inputs)
    found = rows(before, now, wanted)
    show(found)
    different = sum(bool(row.difference) for row in found)
    took = time.monotonic() - begin
    print(f"{len(found) - different} equal, {different} different, against {before.name}; "
          f"{took:.0f} s, {built:.0f} of them for its build")  # fmt: skip
    if not options.keep and not different:
        revision.removed(before)
    return int(different > 0)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except revision.NotBuilt as failure:
        sys.exit(f"golden: {failure}")
