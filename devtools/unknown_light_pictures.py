# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws docs/pictures/unknown_light.png: .venv/bin/python devtools/unknown_light_pictures.py

A ball of unknown colour on a known ground, under a room that the fit does not know. Rows: the room,
its start and what the fit has found; a photo, the fit's render of it, and both under another room.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
import numpy as np  # noqa: E402

from selenite import native  # noqa: E402
from selenite.capture.request import CaptureRequest  # noqa: E402
from selenite.environments import sphere  # noqa: E402
from selenite.fit.fields.environment import view_of  # noqa: E402
from selenite.fit.job import FitJob, fitted_values, scene_at  # noqa: E402
from selenite.fit.plan import prepare  # noqa: E402
from selenite.fit.request import RunRequest, UnknownRequest  # noqa: E402
from selenite.fit.settings import FitSettings  # noqa: E402
from selenite.scene_read.build import build  # noqa: E402

PICTURE = ROOT / "docs" / "pictures" / "unknown_light.png"
WIDTH, HEIGHT, GAP = 200, 150, 6
SMALL = (64, 48)  # of the photos
COLOUR, ROUGHNESS = (0.75, 0.3, 0.1), 0.25


def room(rows: int, windows: list[tuple[float, float, float, float, tuple[float, ...]]]) -> Any:  # noqa: ANN401
    """Grey walls, a darker floor, and windows: azimuth, elevation, size in degrees, radiance."""
    d = sphere.directions(rows, 2 * rows)
    image = np.where(d[..., 2:] > 0, 0.35, 0.12) * np.array([1.0, 0.95, 0.9])
    azimuth = np.degrees(np.arctan2(d[..., 1], d[..., 0]))
    elevation = np.degrees(np.arcsin(d[..., 2]))
    for at, up, wide, high, radiance in windows:
        away = (azimuth - at + 180) % 360 - 180
        inside = (np.abs(away) < wide / 2) & (np.abs(elevation - up) < high / 2)
        image[inside] = radiance
    return image.astype(np.float32)


HIDDEN = room(64, [(-60, 35, 50, 40, (6.0, 6.5, 8.0)), (100, 55, 40, 25, (5.0, 3.5, 2.0))])
OTHER = room(64, [(20, 30, 40, 40, (7.0, 5.0, 3.0)), (-150, 20, 60, 20, (1.0, 2.0, 4.0))])


def scene() -> None:
    """A ball on a ground, seen from three sides."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    ball = made.sphere(
        material=made.material(base_color=(0.5, 0.5, 0.5), roughness=0.5), segments=48
    )
    ball.location = (0, 0, 1)
    bpy.ops.mesh.primitive_plane_add(size=9)
    ground = made.material("Ground", base_color=(0.4, 0.4, 0.4), roughness=0.9)
    plane: Any = bpy.context.object
    plane.data.materials.append(ground)
    made.world(color=(0.4, 0.4, 0.4))
    for number, angle in enumerate((0, 120, 240)):
        camera = made.camera(f"Camera {number + 1}", lens=45)
        a = math.radians(angle)
        camera.location = (6 * math.sin(a), -6 * math.cos(a), 3)
        camera.rotation_euler = (math.radians(70), 0, a)
    whole: Any = bpy.context.scene
    whole.render.resolution_x, whole.render.resolution_y = WIDTH, HEIGHT


def lit(
    found: Any,  # noqa: ANN401
    image: Any,  # noqa: ANN401
    name: str = "Camera 1",
    size: tuple[int, int] = (WIDTH, HEIGHT),
) -> np.ndarray:
    """A render of the native scene under an image of the world; None: its own."""
    if image is not None:
        found = found.with_environment(np.ascontiguousarray(image, np.float32))
    spp = 256 if size == (WIDTH, HEIGHT) else 400
    picture: np.ndarray = native.core().render(found, name, *size, spp, seed=5).image
    return picture


def photos(folder: Path) -> tuple[CaptureRequest, ...]:
    """Under the hidden room, with the true ball."""
    values = made.read()
    world = replace(values.world, color=(1.0, 1.0, 1.0), image=HIDDEN)
    true = build(replace(values, world=world)).with_values(
        {("Body", "base_color"): COLOUR, ("Body", "roughness"): (ROUGHNESS,)}
    )
    requests = []
    for camera in values.cameras:
        path = str(folder / f"{camera.name}.exr")
        native.image().write_exr(path, lit(true, None, camera.name, SMALL))
        requests.append(CaptureRequest(camera.name, path))
    return tuple(requests)


def tile(picture: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """(HEIGHT, WIDTH, 3)"""
    found = np.full((HEIGHT, WIDTH, 3), 1.0, np.float32)
    height, width = picture.shape[:2]
    across = np.arange(WIDTH) * width // WIDTH
    rows = WIDTH * height // width
    down = np.arange(rows) * height // rows
    top = (HEIGHT - rows) // 2
    found[top : top + rows] = np.clip(picture[down][:, across] * scale, 0, 1)
    return found


def main() -> None:
    """Makes the photos, fits, writes the picture and says how far the values are."""
    scene()
    with tempfile.TemporaryDirectory() as folder:
        captures = photos(Path(folder))
        request = RunRequest(
            "unknown_light.blend",
            (
                UnknownRequest("World", "environment", size=128),
                UnknownRequest("Body", "base_color"),
                UnknownRequest("Body", "roughness"),
            ),
            captures,
            FitSettings(height=SMALL[1], iterations=30, spp=16),
        )
        plan = prepare(made.read(), request)
        job = FitJob(plan)
        job.start()
        job.join()
        result = job.result()
    found = result["fields_best"]["World:environment"]
    print(result["stopped_because"], result["seconds"], fitted_values(plan, result))
    fitted = scene_at(plan, result)
    true = plan.scene.with_values(
        {("Body", "base_color"): COLOUR, ("Body", "roughness"): (ROUGHNESS,)}
    )
    hidden, other = (sphere.resampled(image, np.eye(3), 8, 16) for image in (HIDDEN, OTHER))
    pictures = [lit(true, hidden), lit(fitted, None), lit(true, other), lit(fitted, other)]
    error = np.sqrt(np.mean((pictures[3] - pictures[2]) ** 2) / np.mean(pictures[2] ** 2))
    print("relit, relative RMSE:", error)
    start = plan.fields[0].values
    rows = [
        [tile(view_of(image)) for image in (HIDDEN, hidden, start, found)],
        [tile(picture, 0.8) for picture in pictures],
    ]
    space = np.ones((HEIGHT, GAP, 3), np.float32)
    lines = [np.concatenate([x for one in row for x in (one, space)][:-1], axis=1) for row in rows]
    native.image().write_png(str(PICTURE), np.ascontiguousarray(np.concatenate(lines)))
    print(f"wrote {PICTURE}")
    sys.stdout.flush()
    os._exit(0)  # bpy can hang in its own destructors


main()
