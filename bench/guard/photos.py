# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos of the bodies by Cycles and the scenes that fits start from, made once and kept.

Run as a script (`python photos.py FOLDER NAME`) it makes those of one body.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

if __name__ == "__main__":
    _BENCH = Path(__file__).resolve().parents[1]
    sys.path[:0] = [str(_BENCH.parent / "addon"), str(_BENCH)]

from guard.bodies import BODIES, SIZE, Body

_SAMPLES, _MORE_SAMPLES = 1024, 2048  # the latter where light gets through
_SEED = 7321


@dataclass(frozen=True)
class Kept:
    """The scene at the start of the fit, and the photos by camera."""

    scene: Path
    photos: dict[str, Path]


def of(body: Body, folder: Path) -> Kept:
    """Makes what is not there; RuntimeError if Cycles fails. Another body of the same name (its
    values changed) does not take the old photos."""
    digest = hashlib.sha256(repr((body, SIZE, _samples(body))).encode()).hexdigest()[:12]
    place = folder / f"{body.name.replace(' ', '_')}-{digest}"
    cameras = [f"Camera {i + 1}" for i in range(len(body.views))]
    kept = Kept(place / "start.blend", {name: place / f"{name}.exr" for name in cameras})
    if not kept.scene.is_file():  # the last to be written
        place.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, __file__, str(place), body.name]
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
        )
        if not kept.scene.is_file():
            raise RuntimeError(f"{body.name}: no photos by Cycles: {done.stderr[-2000:]}")
    return kept


def _samples(body: Body) -> int:
    clear = "extinction" in body.target or body.target.get("transmission", (0.0,))[0] > 0
    return _MORE_SAMPLES if clear else _SAMPLES


def _make(folder: Path, body: Body) -> None:
    import bpy
    from synthetic import blender_scene

    from selenite.cycles_check.render import render

    scene = blender_scene.make(body.stage(), body.fixed | body.target)
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    for index in range(len(body.views)):
        camera = f"Camera {index + 1}"
        path = folder / f"{camera}.exr"
        render(scene, camera, (SIZE, SIZE), _samples(body), _SEED + index, path)
    scene = blender_scene.make(body.stage(), body.fixed | body.start)
    scene.camera = bpy.data.objects["Camera 1"]
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    partial = folder / "partial.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(partial))
    partial.replace(folder / "start.blend")


if __name__ == "__main__":
    _make(Path(sys.argv[1]), next(body for body in BODIES if body.name == sys.argv[2]))
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)  # bpy can hang in its own destructors
