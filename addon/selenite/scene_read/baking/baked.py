# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of a scene: images that are kept from earlier, and a process that makes the others."""

from __future__ import annotations

import json
import shutil
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np

from ...atomic_files import partial_name
from ...problems import Problem
from ..blender_process import BlenderProcess, baked_folder
from ..reading.process_run import ProcessRun
from ..values import SceneValues
from . import size as sizes
from . import wanted as asked_for
from .wanted import Baker, WantedMaterial

_MODULE = "selenite.scene_read.baking.bake"


@dataclass
class BakeAsked:
    """A step of a reading: bakes what was noted, and puts it into what was read."""

    scene: bpy.types.Scene
    baker: Baker
    read: SceneValues

    def job(self) -> BakeRun:
        """For who goes through the reading."""
        return BakeRun(self)


class BakeRun(ProcessRun):
    """Goes on beside Blender, as a `GraphRender` does."""

    def __init__(self, asked: BakeAsked) -> None:
        super().__init__()
        self._asked = asked
        self._folder = baked_folder()
        self._partial = partial_name(self._folder / "baked")
        self._made: list[Path] = []
        self._sides: dict[str, tuple[int, int]] = {}
        self._keys: dict[str, str] = {}

    def _begin(self) -> BlenderProcess | None:
        asked = self._asked
        photo = sizes.longest_photo(asked.scene)
        for one in asked.baker.materials:
            side = sizes.side_of(one, asked.read, photo)
            self._sides[one.name] = side
            version = bpy.app.version_string
            self._keys[one.name] = asked_for.key_of(one, asked.read, side[0], version)
        missing = [one for one in asked.baker.materials if not self._is_kept(one)]
        if not missing:
            return None
        places = [self._folder, *self._folder.parents]
        self._made = [place for place in places if not place.exists()]
        self._folder.mkdir(parents=True, exist_ok=True)
        process = BlenderProcess(_MODULE, "selenite-bake-")
        process.ask(self._request(missing))
        return process

    def close(self) -> None:
        """Nor does a half of an image remain, or a folder that was made for none."""
        try:
            super().close()
        finally:
            shutil.rmtree(self._partial, ignore_errors=True)
            with suppress(OSError):  # it holds images
                for place in self._made:
                    place.rmdir()

    def outcome(self) -> Problem | None:
        """After `close`: fills in the images, or says what stood in the way."""
        if self.stopped or self.problem is not None:
            return self.problem
        try:
            for one in self._asked.baker.materials:
                self._fill_in(one)
        except (OSError, ValueError, KeyError) as error:
            return self._said(error)
        return None

    def _said(self, error: Exception) -> Problem:
        cause = f"its nodes cannot be baked ({error})"
        cure = "unlink what is not read, or give constant values"
        return Problem(f"Scene '{self._asked.scene.name}'", cause, cure)

    def _is_kept(self, one: WantedMaterial) -> bool:
        return (self._folder / self._keys[one.name] / "report.json").is_file()

    def _request(self, missing: list[WantedMaterial]) -> dict[str, object]:
        return {
            "scene": self._asked.scene.name,
            "folder": str(self._folder),
            "partial": str(self._partial),
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
