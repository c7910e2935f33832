# SPDX-License-Identifier: GPL-3.0-or-later
"""A check in Cycles: another process renders a copy of the file, polled from here.

The copy makes sure that the user's scene stays as it is, whatever happens to the check; the other
process, that Blender stays usable meanwhile and survives a crash of the render.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from .. import grid_files, parameters, write_back
from ..atomic_files import write_json
from ..fit_run.captures.render import Alignment, Gain
from ..fit_run.request import RunRequest
from ..parameters import Values
from ..problems import BadInput, Failed, Problem
from ..scene_read.values import GridValues
from . import compare

WORKER = Path(__file__).with_name("worker.py")
#: Key of images that the panel draws for itself: no picture of the scene, and always unsaved.
DRAWN = "selenite_drawn"


class CheckFailed(Failed):
    """The other process met an error, or ended without a word."""


@dataclass(frozen=True)
class CheckProgress:
    """State of a check at one moment."""

    running: bool
    fraction: float
    text: str


class CheckJob:
    """Start, poll, cancel, result. `close` ends the process and removes its folder."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        request: RunRequest,
        values: Mapping[tuple[str, str], Values],
        grids: Mapping[str, Mapping[str, GridValues]] | None = None,
        images: Mapping[str, str] | None = None,
        gains: Mapping[str, Gain] | None = None,
        environment: str = "",
        alignments: Mapping[str, Alignment] | None = None,
    ) -> None:
        """Saves the copy; the scene may change afterwards. Raises BadInput.

        request: what was fitted, with its captures. values: what is written back into the copy;
        grids: what Volume objects show there, material -> use -> grid. images: files that base
        colours have there, by material. gains, alignments: of photos, by id, where a fit has found
        them. environment: the file of the world's image there, "" for the scene's own.
        """
        problems = _unsaved_pictures()
        if problems:
            raise BadInput(problems)
        self.folder = Path(tempfile.mkdtemp(prefix="selenite-check-"))
        self._process: subprocess.Popen[bytes] | None = None
        try:
            (self.folder / "out").mkdir()
            write_back.save_copy(str(self.folder / "scene.blend"))
            text = json.dumps({
                "scene": scene.name,
                "scripts": _runs_scripts(),
                "run": request.as_json(),
                "values": {parameters.join_name(*key): value for key, value in values.items()},
                "grids": self._keep_grids(grids or {}),
                "images": dict(images or {}),
                "gains": dict(gains or {}),
                "alignments": dict(alignments or {}),
                "environment": environment,
                # for the checkout and the legacy add-on, which are not where Python looks
                "python_path": [*sys.path, str(Path(__file__).resolve().parents[2])],
            })  # fmt: skip
            (self.folder / "request.json").write_text(text, encoding="utf-8")
        except BaseException:
            self.close()
            raise

    def _keep_grids(
        self, grids: Mapping[str, Mapping[str, GridValues]]
    ) -> dict[str, dict[str, dict[str, Any]]]:
        """Writes their numbers into the folder and returns the rest."""
        kept: dict[str, dict[str, dict[str, Any]]] = {}
        for number, (name, uses) in enumerate(grids.items()):
            for use, grid in uses.items():
                file = f"grid-{number}-{use}.npy"
                grid_files.write_npy(self.folder / file, grid.values)
                entry = {"name": grid.name, "file": file, "to_unit": grid.to_unit.tolist()}
                kept.setdefault(name, {})[use] = entry
        return kept

    def start(self) -> None:
        """Returns at once."""
        with (self.folder / "log.txt").open("wb") as log:
            self._process = subprocess.Popen(
                [*_blender(), str(self.folder)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def progress(self) -> CheckProgress:
        """Cheap, at any time."""
        running = self._process is not None and self._process.poll() is None
        try:
            written = json.loads((self.folder / "progress.json").read_text(encoding="utf-8"))
        except OSError:
            return CheckProgress(running, 0.0, "starting Blender")
        return CheckProgress(running, written["fraction"], written["text"])

    def result(self) -> dict[str, Any]:
        """Waits for the end. Raises CheckFailed and BadInput."""
        status = self._process.wait() if self._process is not None else None
        path = self.folder / "report.json"
        if not path.is_file():
            log = self.folder / "log.txt"
            last = log.read_text(errors="replace").splitlines()[-3:] if log.is_file() else []
            raise CheckFailed(f"Blender ended with status {status}: {' / '.join(last)}")
        report: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if "problems" in report:
            raise BadInput([Problem(**item) for item in report["problems"]])
        if "error" in report:
            raise CheckFailed(report["error"])
        return report

    def keep(self, report: dict[str, Any], folder: Path) -> Path:
        """Moves the pictures into a result folder and the numbers into its result.json (key
        `cycles`), which is made if there is none; returns the sheet's path. Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        for path in sorted((self.folder / "out").iterdir()):
            shutil.move(str(path), str(folder / path.name))
        target = folder / "result.json"
        content = json.loads(target.read_text(encoding="utf-8")) if target.is_file() else {}
        write_json(target, content | {"cycles": report})
        return folder / "cycles_check.png"

    def close(self) -> None:
        """Ends the process if it still runs; nothing of it remains. May be called twice."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def lines(report: dict[str, Any]) -> list[str]:
    """The numbers for the terminal and for Blender's report."""
    found = []
    for photo, row in report["photos"].items():
        found.append(
            compare.line(f"{photo}: Selenite against Cycles", row["native_against_cycles"])
        )
        found.append(compare.line(f"{photo}: Cycles against photo", row["cycles_against_photo"]))
    return found


def _blender() -> list[str]:
    """This Blender without a window, or this Python with its module bpy, up to the folder."""
    if not bpy.app.binary_path:
        return [sys.executable, "-P", str(WORKER)]
    trust = "-y" if _runs_scripts() else "-Y"
    words = [bpy.app.binary_path, "-b", "--factory-startup", trust, "-noaudio"]
    return [*words, "--python-exit-code", "1", "--python", str(WORKER), "--"]


def _runs_scripts() -> bool:
    """Whether scripts of the file (drivers) run here: only then they run there."""
    trusted = bpy.context.preferences.filepaths.use_scripts_auto_execute
    return bool(bpy.app.binary_path and trusted and not bpy.app.autoexec_fail)


def _unsaved_pictures() -> list[Problem]:
    """The copy would show what is on disk instead of them."""
    return [
        Problem(
            f"Image '{image.name}'",
            "its pixels were changed and are not saved, so a copy of the file lacks them",
            "save or pack it",
        )
        for image in bpy.data.images
        if image.type not in {"RENDER_RESULT", "COMPOSITING"}
        if image.is_dirty and image.users > 0 and not image.get(DRAWN)
    ]
