# SPDX-License-Identifier: GPL-3.0-or-later
"""Another Blender process that works on a copy of the file, polled from here.

The copy makes sure that the user's scene stays as it is, whatever happens; the other process, that
Blender stays usable meanwhile and survives a crash.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import bpy

from ..messages import thing
from ..paths import user_folder, why_not_folder
from ..problems import BadInput, Failed, Problem, problems_in
from .blend_file import write_blend_copy
from .reading.without_words import without_words

#: File in the folder that asks the process to end and keep what it has.
STOP = "stop"
#: Seconds that a process has for that before it is ended.
_PATIENCE = 5.0
#: Key of images that the panel draws for itself: no picture of the scene, and always unsaved.
DRAWN = "selenite_drawn"
#: Where baked images are kept, in that of the results of a file; and the variable that says it to
#: a process whose file is a copy.
_BAKED, _BAKED_VARIABLE = "//selenite-fits/baked", "SELENITE_BAKED"
#: Runs a module of the add-on.
_WORKER = Path(__file__).with_name("process_worker.py")


class ProcessFailed(Failed):
    """The other process met an error, or ended without a word."""


@dataclass(frozen=True)
class ProcessProgress:
    """State of the other process at one moment."""

    running: bool
    fraction: float
    text: str


class BlenderProcess:
    """Start, poll, result. `close` ends the process and removes its folder."""

    def __init__(self, module: str, prefix: str) -> None:
        """Saves the copy as scene.blend in `folder`; the scene may change afterwards. Raises
        BadInput. module: what runs there, see process_worker; prefix: of the folder's name."""
        problems = _unsaved_pictures()
        if problems:
            raise BadInput(problems)
        self.folder = Path(tempfile.mkdtemp(prefix=prefix))
        self._module = module
        self._process: subprocess.Popen[bytes] | None = None
        try:
            with without_words():
                write_blend_copy(str(self.scene_file), "make room on the disk of temporary files")
        except BadInput:
            self.close()
            raise

    @property
    def scene_file(self) -> Path:
        """The copy."""
        return self.folder / "scene.blend"

    def ask(self, request: Mapping[str, object]) -> None:
        """Writes request.json for the worker."""
        asked = {
            **request,
            "module": self._module,
            "scripts": _runs_scripts(),
            # for the checkout and the legacy add-on, which are not where Python looks
            "python_path": [*sys.path, str(Path(__file__).resolve().parents[2])],
        }
        (self.folder / "request.json").write_text(json.dumps(asked), encoding="utf-8")

    def start(self) -> None:
        """Returns at once."""
        with (self.folder / "log.txt").open("wb") as log:
            self._process = subprocess.Popen(
                [*blender_words(_WORKER), str(self.folder)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **self._own_variables()},
            )

    def _own_variables(self) -> dict[str, str]:
        """What that Blender keeps for itself goes with the folder, however it ends."""
        temporary = dict.fromkeys(("TMPDIR", "TMP", "TEMP"), str(self.folder))
        return temporary | {_BAKED_VARIABLE: str(baked_folder())}

    def progress(self) -> ProcessProgress:
        """Cheap, at any time."""
        running = self._process is not None and self._process.poll() is None
        try:
            written = json.loads((self.folder / "progress.json").read_text(encoding="utf-8"))
        except OSError:
            return ProcessProgress(running, 0.0, "starting Blender")
        return ProcessProgress(running, written["fraction"], written["text"])

    def result(self) -> dict[str, object]:
        """Waits for the end. Raises ProcessFailed and BadInput."""
        status = self._process.wait() if self._process is not None else None
        path = self.folder / "report.json"
        if not path.is_file():
            log = self.folder / "log.txt"
            last = log.read_text(errors="replace").splitlines()[-3:] if log.is_file() else []
            raise ProcessFailed(f"Blender ended with status {status}: {' / '.join(last)}")
        report: dict[str, object] = json.loads(path.read_text(encoding="utf-8"))
        if problems := problems_in(report):
            raise BadInput(problems)
        if "error" in report:
            raise ProcessFailed(str(report["error"]))
        return report

    def ask_to_stop(self) -> None:
        """Returns at once: a process that looks for it ends soon, and reports what it has."""
        with suppress(OSError):  # the folder is gone with the process
            (self.folder / STOP).touch()

    def wind_up(self) -> None:
        """As `close`, for a process that has others of its own: it has some seconds to end them."""
        self.ask_to_stop()
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_PATIENCE)
        self.close()

    def close(self) -> None:
        """Ends the process if it still runs; nothing of it remains. May be called twice."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def is_copy() -> bool:
    """Whether this process was started here, and its file is a copy."""
    return _BAKED_VARIABLE in os.environ


def baked_folder() -> Path:
    """Where baked images are kept: beside the results of a saved file, else in the user's own
    folder, or where neither can be written with the temporary files."""
    if inherited := os.environ.get(_BAKED_VARIABLE):
        return Path(inherited)
    folder = user_folder() / "baked"
    if bpy.data.filepath:
        folder = Path(bpy.path.abspath(_BAKED)).absolute()
    return Path(tempfile.gettempdir()) / "selenite-baked" if why_not_folder(folder) else folder


def blender_words(script: Path) -> list[str]:
    """Runs a script in this Blender without a window, or in this Python with its module bpy; what
    follows is for the script."""
    if not bpy.app.binary_path:
        return [sys.executable, "-P", str(script)]
    trust = "-y" if _runs_scripts() else "-Y"
    words = [bpy.app.binary_path, "-b", "--factory-startup", trust, "-noaudio"]
    return [*words, "--python-exit-code", "1", "--python", str(script), "--"]


def _runs_scripts() -> bool:
    """Whether scripts of the file (drivers) run here: only then they run there."""
    trusted = bpy.context.preferences.filepaths.use_scripts_auto_execute
    return bool(bpy.app.binary_path and trusted and not bpy.app.autoexec_fail)


def _unsaved_pictures() -> list[Problem]:
    """The copy would show what is on disk instead of them."""
    return [
        Problem(
            thing("Image", image.name),
            "its pixels were changed and are not saved, so a copy of the file lacks them",
            "save or pack it",
        )
        for image in bpy.data.images
        if image.type not in {"RENDER_RESULT", "COMPOSITING"}
        if image.is_dirty and image.users > 0 and not image.get(DRAWN)
    ]
