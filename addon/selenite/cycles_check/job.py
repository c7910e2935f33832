# SPDX-License-Identifier: GPL-3.0-or-later
"""A check in Cycles: another process renders a copy of the file, polled from here.

The copy makes sure that the user's scene stays as it is, whatever happens to the check; the other
process, that Blender stays usable meanwhile and survives a crash of the render.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

from .. import grid_files, parameters
from ..atomic_files import write_json
from ..capture.prepared import Capture
from ..fit.request import RunRequest
from ..parameters import Values
from ..scene_read.blender_process import BlenderProcess
from ..scene_read.values import GridValues
from . import compare

if TYPE_CHECKING:
    from ..json_text import JsonObject

#: Relative bias of a photo, and RMSE, beyond noise, up to which Cycles agrees with a fit.
BIAS_LIMIT, RMSE_LIMIT = 0.01, 0.05
_MODULE = "selenite.cycles_check.worker"


class CheckJob(BlenderProcess):
    """Start, poll, cancel, result. `close` ends the process and removes its folder."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        request: RunRequest,
        values: Mapping[tuple[str, str], Values],
        grids: Mapping[str, Mapping[str, GridValues]] | None = None,
        surfaces: Mapping[str, str] | None = None,
        taken: Sequence[Capture] = (),
        environment: str = "",
    ) -> None:
        """Saves the copy; the scene may change afterwards. Raises BadInput.

        request: what was fitted, with its captures. values: what is written back into the copy;
        grids: what Volume objects show there, material -> use -> grid. images: files that base
        colours have there, by material. taken: captures with what a fit has found of them, see
        `captures.render.as_found`. environment: the file of the world's image there, "" for the
        scene's own.
        """
        super().__init__(_MODULE, "selenite-check-")
        try:
            (self.folder / "out").mkdir()
            self.ask({
                "scene": scene.name,
                "run": request.as_json(),
                "values": {parameters.join_name(*key): value for key, value in values.items()},
                "grids": self._keep_grids(grids or {}),
                "surfaces": dict(surfaces or {}),
                "taken": {
                    item.id: {"gain": item.gain, "alignment": item.alignment} for item in taken
                },
                "environment": environment,
            })  # fmt: skip
        except BaseException:
            self.close()
            raise

    def _keep_grids(
        self, grids: Mapping[str, Mapping[str, GridValues]]
    ) -> dict[str, dict[str, JsonObject]]:
        """Writes their numbers into the folder and returns the rest."""
        kept: dict[str, dict[str, JsonObject]] = {}
        for number, (name, uses) in enumerate(grids.items()):
            for use, grid in uses.items():
                file = f"grid-{number}-{use}.npy"
                grid_files.write_npy(self.folder / file, grid.values)
                entry = {"name": grid.name, "file": file, "to_unit": grid.to_unit.tolist()}
                kept.setdefault(name, {})[use] = entry
        return kept

    def keep(self, report: JsonObject, folder: Path) -> Path:
        """Moves the pictures into a result folder and the numbers into its result.json (key
        `cycles`), which is made if there is none; returns the sheet's path. Raises OSError."""
        folder.mkdir(parents=True, exist_ok=True)
        for path in sorted((self.folder / "out").iterdir()):
            shutil.move(str(path), str(folder / path.name))
        target = folder / "result.json"
        content = json.loads(target.read_text(encoding="utf-8")) if target.is_file() else {}
        write_json(target, content | {"cycles": report})
        return folder / "cycles_check.png"


def verdict(report: JsonObject) -> str:
    """Whether Cycles shows what was fitted, in one sentence. What few samples make of the noise is
    known no better than it: a difference as large as the noise is none."""
    worst, most, where = 1.0, 0.0, ""
    for photo, row in report["photos"].items():
        found = row["native_against_cycles"]
        for kind, limit in (("bias", BIAS_LIMIT), ("rmse", RMSE_LIMIT)):
            size = abs(found[f"relative_{kind}_beyond_noise"])
            share = size / max(limit, found[f"relative_{kind}_noise"])
            if share > worst:
                worst, most, where = share, size, photo
    if not where:
        return "Cycles agrees with the fit"
    return f"Cycles differs from the fit by {100 * most:.1f} % in '{where}': see its pictures"


def lines(report: JsonObject) -> list[str]:
    """The numbers for the terminal and for Blender's report."""
    found = []
    for photo, row in report["photos"].items():
        found.append(
            compare.line(f"{photo}: Selenite against Cycles", row["native_against_cycles"])
        )
        found.append(compare.line(f"{photo}: Cycles against photo", row["cycles_against_photo"]))
    return found
