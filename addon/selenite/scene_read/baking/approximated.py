# SPDX-License-Identifier: GPL-3.0-or-later
"""What approximated materials change in a picture: measured by another process, and kept."""

from __future__ import annotations

import hashlib
import json
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import TypedDict, cast

import bpy

from ...atomic_files import write_json
from ...messages import remark, thing
from ...problems import Problem
from ..blender_process import BlenderProcess, baked_folder
from ..options import ReadingOptions
from ..reading.process_run import ProcessRun
from ..values import SceneValues

_MODULE = "selenite.cycles_check.approximation"


class ComparisonRequest(TypedDict):
    """What the other process is asked."""

    scene: str
    scripts: bool
    options: dict[str, object]


class Difference(TypedDict):
    """From the picture by Cycles, relative to its mean: on average and in the worst block."""

    camera: str
    mean: float
    worst: float


@dataclass
class ComparisonAsked:
    """A step of a reading: warns of what approximations change in a picture of the scene."""

    scene: bpy.types.Scene
    options: ReadingOptions
    approximations: list[str]
    read: SceneValues

    def job(self) -> ComparisonRun:
        """For who goes through the reading."""
        return ComparisonRun(self)


class ComparisonRun(ProcessRun):
    """Renders a copy of the file both ways; a difference that is known is not measured again."""

    def __init__(self, asked: ComparisonAsked) -> None:
        super().__init__()
        self._asked = asked
        self._kept = _kept_at(asked)

    def outcome(self) -> Problem | None:
        """Never a problem: a difference that nobody knows is said to be unknown."""
        if self.stopped:
            return None
        title = thing("Scene", self._asked.scene.name)
        if self.problem is not None:
            cause = self.problem.cause
            self._asked.read.warn(
                remark(title, f"what approximations change is not known: {cause}")
            )
            return None
        if self.report and self._kept is not None:
            self._kept.parent.mkdir(parents=True, exist_ok=True)
            write_json(self._kept, self.report)
        found = cast("Difference", self.report) if self.report else self._known()
        if found is not None:
            self._asked.read.warn(
                remark(
                    title,
                    "approximated materials change the picture of camera "
                    f"'{found['camera']}' by {100 * found['mean']:.3g} % on average and "
                    f"{100 * found['worst']:.3g} % in the worst of its blocks, against Cycles",
                )
            )
        return None

    def _begin(self) -> BlenderProcess | None:
        if self._known() or not self._asked.read.cameras:
            return None
        process = BlenderProcess(_MODULE, "selenite-compare-")
        asked = self._asked
        process.ask({"scene": asked.scene.name, "options": asked.options.as_json()})
        return process

    def _said(self, error: Exception) -> Problem:
        return Problem(thing("Scene", self._asked.scene.name), str(error), "")

    def _known(self) -> Difference | None:
        if self._kept is None or not self._kept.is_file():
            return None
        return cast("Difference", json.loads(self._kept.read_text(encoding="utf-8")))


def _kept_at(asked: ComparisonAsked) -> Path | None:
    """The file of the difference; None where the scene is not as its file says."""
    path = Path(bpy.data.filepath)
    # Without a window every file counts as changed.
    changed = bpy.data.is_dirty and not bpy.app.background
    if changed or not bpy.data.filepath or not path.is_file():
        return None
    read = asked.read
    values = (read.cameras, read.objects, read.lights, read.world, read.materials, read.meshes)
    facts = (path.stat().st_mtime_ns, path.stat().st_size, bpy.app.version_string)
    words = repr((facts, asked.scene.name, asked.options, asked.approximations))
    found = hashlib.sha256(words.encode() + pickle.dumps(values))
    return baked_folder() / f"approximated-{found.hexdigest()[:32]}.json"
