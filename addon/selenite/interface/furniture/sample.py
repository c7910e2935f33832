# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample scene: another Blender makes it, and this one opens it with its own windows."""

from __future__ import annotations

import importlib.util
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import bpy
import numpy as np

from ...advice.information.job import BackgroundJob, Step
from ...demo import NAME, scenes
from ..state import SAMPLE, is_idle
from ..texts import announce
from ..ticking import CancelsWork, redraw, show_status

_FILE = "start.blend"
_POLL = 0.2  # seconds
#: Seconds in which the other Blender has made the scene, mostly; the bar is filled by them.
_USUAL = 10.0
_WORDS = """import sys
sys.path[:0] = [{scenes!r}, {addon!r}]
sys.path.append({numpy!r})
import jade_pendant, pathlib, shutil
target = pathlib.Path({target!r})
for photo in jade_pendant.PHOTOS.glob("*.png"):
    shutil.copy(photo, target.parent / "photos")
jade_pendant.EXAMPLE.save_start(target)
"""


class Making:
    """Another Blender makes the scene, beside a folder with the photos that its Cycles would take.
    Then `path` is there; `trouble` says why it is not."""

    def __init__(self) -> None:
        self.path: Path | None = None
        self.trouble = ""
        folder = Path(bpy.app.tempdir) / "selenite-sample"
        (folder / "photos").mkdir(parents=True, exist_ok=True)
        self._target = folder / _FILE
        words = _WORDS.format(
            scenes=str(scenes()),
            addon=str(_importable()),
            numpy=str(Path(np.__file__).parents[1]),  # one that this Blender has found elsewhere
            target=str(self._target),
        )
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1"]
        self._command = [*command, "--python-expr", words]

    def steps(self) -> Iterator[Step]:
        """Some each second, until the other Blender has ended."""
        self._target.unlink(missing_ok=True)
        said = self._target.with_name("log.txt")
        with (
            said.open("wb") as log,
            subprocess.Popen(self._command, stdout=log, stderr=log) as process,
        ):
            try:
                seconds = 0.0
                while process.poll() is None:
                    yield Step(seconds / (seconds + _USUAL), "Making the sample scene")
                    time.sleep(_POLL)
                    seconds += _POLL
            finally:
                process.kill()
        if process.returncode == 0 and self._target.is_file():
            self.path = self._target
        else:
            words = said.read_text(errors="replace").split()
            self.trouble = " ".join(words[-30:]) or f"status {process.returncode}"

    def cancel(self) -> None:
        """The other Blender ends with the thread, at its next step."""


class SELENITE_OT_open_sample(bpy.types.Operator):
    """Open the sample scene with its photos: a pendant whose material is to be found. Save your own
    file first"""

    bl_idname = "selenite.open_sample"
    bl_label = "Open Sample Scene"

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        """It is part of this package, and nothing runs."""
        if not (scenes() / f"{NAME}.py").is_file():
            cls.poll_message_set("This package has no sample scene; in a checkout use ./dev demo")
            return False
        cls.poll_message_set("A fit or a check is running")
        return is_idle()

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Asks first where the open file has changes."""
        if bpy.data.is_dirty:
            return set(context.window_manager.invoke_confirm(self, event))
        return self.execute(context)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """In place of the open file. In a window a timer waits for the other Blender: a file must
        not be opened by an operator that goes on."""
        job = BackgroundJob(Making())
        if bpy.app.background:
            job.start()
            job.join()
            if job.work.path is None:
                announce(self, {"ERROR"}, _failure(job.work))
                return {"CANCELLED"}
            bpy.ops.wm.open_mainfile(filepath=str(job.work.path))
            _prefer_draft()
            return {"FINISHED"}
        SAMPLE.start(job, context.scene.name)
        bpy.app.timers.register(_wait, first_interval=_POLL, persistent=True)
        redraw(context)
        return {"FINISHED"}


class SELENITE_OT_cancel_sample(CancelsWork):
    """Stop; the open file stays"""

    bl_idname = "selenite.cancel_sample"
    bl_label = "Cancel"
    background = SAMPLE


def made_sample() -> Path:
    """At once, in this Blender's folder for temporary files."""
    work = Making()
    for _ in work.steps():
        pass
    assert work.path is not None, work.trouble
    return work.path


def _wait() -> float | None:
    """Opens the scene once it is made, with the windows and sidebars as they are."""
    job = SAMPLE.job
    if job is None:
        return None
    running, step = job.progress()
    SAMPLE.step = step
    if running:
        show_status(bpy.context, step.text, step.fraction)
        redraw(bpy.context)
        return _POLL
    SAMPLE.job = None
    show_status(bpy.context, None)
    job.join()
    work = job.work
    assert isinstance(work, Making)  # noqa: S101 - nothing else is started here
    if work.path is not None:
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window):
            bpy.ops.wm.open_mainfile(filepath=str(work.path), load_ui=False)
        # Later: what this timer knows of windows is that of the file before.
        bpy.app.timers.register(_prefer_draft, first_interval=0.1)
    elif work.trouble:
        SAMPLE.lines = [_failure(work)]
        redraw(bpy.context)
    return None


def _prefer_draft() -> None:
    """Its fit takes about a minute."""
    for scene in bpy.data.scenes:
        scene.selenite.preset = "draft"


def _failure(work: Making) -> str:
    return f"The sample scene could not be made: {work.trouble}"


def _importable() -> Path:
    """The folder in which `selenite` is: of a checkout, of an add-on, or of an extension's wheel,
    which a Blender of factory settings does not search."""
    found = importlib.util.find_spec("selenite")
    assert found is not None and found.origin is not None  # the add-on's native modules are there
    return Path(found.origin).parents[1]


CLASSES = (SELENITE_OT_open_sample, SELENITE_OT_cancel_sample)
