# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs commands of one revision in one process: `python run_cases.py JOB.json`.

The job names the package of the revision, the folder of scenes and photos, and the commands with
their folders. What a command leaves: report.json (the object of --json), result/ (the folder of a
fit), shown.json (values in the saved scene), done.json at the end. An interrupted fit leaves
interrupted/PHASE/, a copy of the folder of the run as it was in that phase, which is what a killed
process leaves: each file there is replaced as a whole.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import bpy  # noqa: E402

from golden import renamed  # noqa: E402

#: Polls of a running fit in one phase, and whole states of it, after which its copy is kept.
_POLLS, _STATES = 40, 3
_ITERATIONS = 2  # of a descent, before they count
_PAUSE = 0.002  # seconds between two polls
_DESCENT, _REFINEMENT, _COMPARISON = "descent", "refinement", "comparison"


class Interrupted:
    """Copies the folder of a running fit in each of some phases."""

    def __init__(self, folder: Path, phases: list[str]) -> None:
        self._folder, self._wanted = folder, phases
        self._phase = ""
        self._polls = self._states = 0
        self._state: tuple[str, int] = ("", 0)
        #: Phase -> (the one it was copied in, iterations done): a revision may have no word for a
        #: comparison.
        self.copied: dict[str, tuple[str, int]] = {}

    def poll(self, job: Any, run: Path) -> None:
        """After the record was brought up to date in the phase that the job is in."""
        progress = job.progress()
        phase, iterations = renamed.PHASES[progress.phase], progress.iteration
        if phase != self._phase:
            self._phase, self._polls, self._states = phase, 0, -1  # that one may be older
        if phase == _DESCENT and iterations < _ITERATIONS:
            self._polls, self._states = 0, -1
        self._polls += 1
        state = max(((p.name, p.stat().st_mtime_ns) for p in run.glob("*.state")), default=("", 0))
        if state != self._state:
            self._state = state
            self._states += 1
        if phase in self._wanted and self._states < _STATES and self._polls <= _POLLS:
            self._copy(run, phase, phase, iterations)
        elif phase == _REFINEMENT and self.copied.get(_COMPARISON, ("",))[0] != _COMPARISON:
            self._copy(run, _COMPARISON, phase, iterations)

    def _copy(self, run: Path, name: str, phase: str, iterations: int) -> None:
        if name not in self._wanted or not _goes_on_exactly(run):
            return
        target = self._folder / name / "run.unfinished"
        if target.parent.exists():
            shutil.rmtree(target.parent)
        shutil.copytree(run, target)
        self.copied[name] = (phase, iterations)


def _goes_on_exactly(run: Path) -> bool:
    """Whether the whole state of the newest stage is there, or nothing of it was done."""
    try:
        state = json.loads((run / "state.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return True
    if "parts" not in state:  # since stages are native there is nothing but whole states
        return True
    parts, saved = state["parts"], state.get("optimiser")
    return parts[-1]["iterations"] == 0 or bool(saved and saved["part"] == len(parts))


@contextlib.contextmanager
def _watched(interrupted: Interrupted) -> Iterator[None]:
    """Fits update their record all the time, and `interrupted` polls it."""
    from selenite.fit.checkpoint import Recorder

    name = renamed.first_of(Recorder, renamed.UPDATE_RECORD)
    record, sleep = getattr(Recorder, name), time.sleep

    def update(recorder: Any, job: Any, *, now: bool = False) -> None:
        before = job.progress().phase
        record(recorder, job, now=True)
        if now:
            return
        if hasattr(recorder, "_ask_for_state"):
            recorder._ask_for_state(job)
        else:  # of a revision whose states are handed over in memory
            job.request_state()
        if job.progress().phase == before:
            interrupted.poll(job, recorder.folder)

    setattr(Recorder, name, update)
    time.sleep = lambda seconds: sleep(min(seconds, _PAUSE))
    try:
        yield
    finally:
        setattr(Recorder, name, record)
        time.sleep = sleep


@contextlib.contextmanager
def _with_settings(settings: dict[str, Any]) -> Iterator[None]:
    """Native fits get these settings, under the names that the revision has for them."""
    from selenite import native

    core = native.core()
    own = {name: getattr(core, name) for name in ("Fit", "Stage") if hasattr(core, name)}

    def with_settings(make: Callable[..., Any]) -> Callable[..., Any]:
        def made(*arguments: Any, **stages: Any) -> Any:
            if stages:  # each has settings of its own
                return make(*arguments, **stages)
            *others, given = arguments
            return _first_known(lambda names: make(*others, given | names), settings)

        return made

    for name, make in own.items():
        setattr(core, name, with_settings(make))
    try:
        yield
    finally:
        for name, make in own.items():
            setattr(core, name, make)


def _first_known(make: Callable[[dict[str, Any]], Any], settings: dict[str, Any]) -> Any:
    known: dict[str, Any] = {}
    for name, value in settings.items():
        refusals = []
        for word in renamed.SETTINGS[name]:
            try:
                make(known | {word: value})
            except (ValueError, KeyError) as error:
                refusals.append(str(error))
                continue
            known[word] = value
            break
        else:
            raise ValueError(f"setting '{name}': {'; '.join(refusals)}")
    return make(known)


def _shown(path: Path) -> dict[str, Any]:
    """What the saved scene holds: inputs of nodes, lamps, images."""
    bpy.ops.wm.open_mainfile(filepath=str(path))
    found: dict[str, Any] = {}
    for owner in (*bpy.data.materials, *bpy.data.worlds):
        for node in owner.node_tree.nodes if owner.use_nodes else ():
            for index, item in enumerate(node.inputs):
                value = getattr(item, "default_value", None)
                if value is None or isinstance(value, str):
                    continue
                numbers = list(value) if hasattr(value, "__len__") else [value]
                key = f"{owner.name}/{node.name}/{index} {item.name}"
                found[key] = {"linked": item.is_linked, "value": [float(x) for x in numbers]}
    for lamp in bpy.data.lights:
        found[f"{lamp.name}/lamp"] = [float(lamp.energy), *map(float, lamp.color)]
    for image in bpy.data.images:
        pixels = bytes(memoryview(_pixels(image)))
        about = {"size": list(image.size), "pixels": hashlib.sha256(pixels).hexdigest()}
        found[f"{image.name}/image"] = about
    return found


def _pixels(image: bpy.types.Image) -> Any:
    import numpy as np

    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return pixels


def run(command: dict[str, Any]) -> None:
    """One command; what goes wrong is in done.json."""
    from selenite.cli import main

    folder = Path(command["folder"])
    folder.mkdir(parents=True)
    words, is_fit = list(command["words"]), command["words"][0] == "fit"
    if is_fit:
        words += [f"--out={folder / 'fits'}", f"--save={folder / 'saved.blend'}"]
    interrupted = Interrupted(folder / "interrupted", command.get("interrupted", []))
    output = io.StringIO()
    begin = time.monotonic()
    with contextlib.ExitStack() as around:
        if command.get("settings"):
            around.enter_context(_with_settings(command["settings"]))
        if command.get("interrupted"):
            around.enter_context(_watched(interrupted))
        around.enter_context(contextlib.redirect_stdout(output))
        status = main([*words, "--json"])
    done = {"seconds": time.monotonic() - begin, "status": status, "copied": interrupted.copied}
    report = json.loads(output.getvalue().splitlines()[-1])
    if status == 0 and is_fit:
        Path(report["folder"]).rename(folder / "result")
        _write(folder / "shown.json", _shown(folder / "saved.blend"))
        (folder / "saved.blend").unlink()
    elif status:
        done["error"] = json.dumps(report, ensure_ascii=False)
    _write(folder / "report.json", report)
    _write(folder / "done.json", done)


def _write(path: Path, content: Any) -> None:
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False), encoding="utf-8")


def _make_mask(inputs: Path) -> None:
    """A mask of the size of most photos, black at its left."""
    import numpy as np

    from selenite import native

    pixels = np.ones((24, 32, 3), np.float32)
    pixels[:, :7] = 0
    native.image().write_png(str(inputs / "mask.png"), pixels)


def _run_all(job: dict[str, Any]) -> None:
    import selenite

    if Path(selenite.__file__).parent != Path(job["package"]):
        raise RuntimeError(f"{selenite.__file__} was imported in place of {job['package']}")
    if job.get("mask"):
        _make_mask(Path(job["mask"]))
    for command in job["commands"]:
        print(f"== {command['name']}", file=sys.stderr, flush=True)
        run(command)


if __name__ == "__main__":
    try:
        _run_all(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    except Exception:  # as Python would, before the process ends the hard way
        traceback.print_exc()
        sys.stderr.flush()
        os._exit(1)
    os._exit(0)  # bpy can hang in its own destructors
