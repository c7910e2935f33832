# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of a scene: images that are kept from earlier, and a process that makes the others."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ...problems import BadInput, Failed, Problem
from ..blender_process import WORKER, BlenderProcess, baked_folder
from ..values import SceneValues
from . import size as sizes
from . import wanted as asked_for
from .wanted import Baker, WantedMaterial

_MODULE = "selenite.scene_read.baking.bake"
_POLL = 0.05  # seconds


@dataclass
class BakeAsked:
    """A step of a reading: bakes what was noted, and puts it into what was read."""

    scene: bpy.types.Scene
    baker: Baker
    read: SceneValues

    def job(self) -> BakeRun:
        """For who goes through the reading."""
        return BakeRun(self)


class _NothingWaits:
    """As `entry` of a render: the other process needs no turn of this one."""

    def let_on(self) -> bool:
        """Nobody has entered."""
        return False

    def open(self) -> None:
        """Nobody waits."""


class BakeRun:
    """Goes on beside Blender, as a `GraphRender` does."""

    def __init__(self, asked: BakeAsked) -> None:
        self.stopped = False
        self.entry = _NothingWaits()
        self._asked = asked
        self._process: BlenderProcess | None = None
        self._problem: Problem | None = None
        self._folder = baked_folder()
        self._sides: dict[str, tuple[int, int]] = {}
        self._keys: dict[str, str] = {}

    def start(self, *, waits: bool, note: Callable[[str], None] | None = None) -> None:
        """waits: returns at the end; `note` is told how far it is."""
        asked = self._asked
        photo = sizes.longest_photo(asked.scene)
        for one in asked.baker.materials:
            side = sizes.side_of(one, asked.read, photo)
            self._sides[one.name] = side
            version = bpy.app.version_string
            self._keys[one.name] = asked_for.key_of(one, asked.read, side[0], version)
        missing = [one for one in asked.baker.materials if not self._is_kept(one)]
        if not missing:
            return
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._process = BlenderProcess(WORKER, "selenite-bake-")
            self._process.ask(self._request(missing))
            self._process.start()
        except (BadInput, OSError) as error:
            self._fail(error)
            return
        said = ""
        while waits and self.is_running():
            if note is not None and (text := self.text()) != said:
                said = text
                note(said)
            time.sleep(_POLL)

    def is_running(self) -> bool:
        """Whether the other process is at work; ends it where nobody wants it any more."""
        if self._process is None:
            return False
        if self.stopped:
            self._process.close()
        return self._process.progress().running

    def text(self) -> str:
        """How far it is."""
        return self._process.progress().text if self._process is not None else ""

    def close(self) -> None:
        """Takes in what the other process has left, and removes it."""
        process, self._process = self._process, None
        if process is None:
            return
        try:
            if not self.stopped and not process.progress().running:
                process.result()
        except (BadInput, Failed, OSError) as error:
            self._fail(error)
        finally:
            process.close()

    def outcome(self) -> Problem | None:
        """After `close`: fills in the images, or says what stood in the way."""
        if self.stopped or self._problem is not None:
            return self._problem
        try:
            for one in self._asked.baker.materials:
                self._fill_in(one)
        except (OSError, ValueError, KeyError) as error:
            self._fail(error)
        return self._problem

    def _fail(self, error: Exception) -> None:
        if isinstance(error, BadInput):
            self._problem = error.problems[0]
            return
        cause = f"its nodes cannot be baked ({error})"
        cure = "unlink what is not read, or give constant values"
        self._problem = Problem(f"Scene '{self._asked.scene.name}'", cause, cure)

    def _is_kept(self, one: WantedMaterial) -> bool:
        return (self._folder / self._keys[one.name] / "report.json").is_file()

    def _request(self, missing: list[WantedMaterial]) -> dict[str, Any]:
        return {
            "module": _MODULE,
            "scene": self._asked.scene.name,
            "folder": str(self._folder),
            "materials": [
                {
                    "key": self._keys[one.name],
                    "datablock": one.datablock,
                    "library": one.library,
                    "size": self._sides[one.name][0],
                    "tiles": self._sides[one.name][1],
                    "sees_others": any(item.sees_others for item in one.outputs),
                    "objects": [
                        {"name": name, "library": library, "slots": slots}
                        for (name, library), slots in one.users.items()
                    ],
                    "outputs": [
                        {
                            "groups": item.groups,
                            "node": item.node,
                            "socket": item.socket,
                            "noisy": item.of_chance,
                        }
                        for item in one.outputs
                    ],
                }
                for one in missing
            ],
        }

    def _fill_in(self, one: WantedMaterial) -> None:
        folder = self._folder / self._keys[one.name]
        report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        pictures = [np.load(folder / f"output-{at}.npy") for at in range(len(one.outputs))]
        maps = {user: np.load(folder / f"map-{at}.npy") for at, user in enumerate(one.users)}
        asked_for.fill_in(one, self._asked.read, pictures, maps)
        for output, error in zip(one.outputs, report["errors"], strict=True):
            self._asked.read.warn(
                f"Material '{one.datablock}': {output.said} is baked to {report['size']} x "
                f"{report['size']} pixels, which are off by {100 * error:.2g} % on average"
            )
