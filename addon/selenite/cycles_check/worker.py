# SPDX-License-Identifier: GPL-3.0-or-later
"""What the process does that checks a fit in Cycles; see `job`, which starts it on a copy of the
file."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import bpy
    import numpy as np

    from .._core import Scene
    from ..capture.prepared import Capture
    from ..fit.settings import FitSettings
    from ..scene_read.values import CameraValues, GridValues
    from .report import CheckedPhoto, CheckReport, CheckRequest, GridFile

#: Cycles renders that often, with that many seeds; their spread is the noise.
SEEDS = 4
#: Radiance at which the pictures of differences are brightest.
LARGEST_ERROR = 0.2


def run(folder: Path, request: CheckRequest, note: Callable[[float, str], None]) -> CheckReport:
    """Writes the pictures and the sheet into `folder` and returns the report; note: of progress."""
    import bpy

    from selenite import parameters, write_back
    from selenite.capture.prepared import UNALIGNED, read_captures
    from selenite.capture.scene_captures import packed_photos
    from selenite.capture.window import WHOLE, cropped_camera
    from selenite.cycles_check import render_settings
    from selenite.cycles_check.alignment import moved_window
    from selenite.fit.fields import with_grids
    from selenite.fit.plan import build_scene
    from selenite.fit.request import RunRequest
    from selenite.fit.unknowns import fitted_owners
    from selenite.paths import file_stems
    from selenite.problems import BadInput
    from selenite.report.pictures import sheet
    from selenite.scene_read.blend_file import open_blend
    from selenite.scene_read.scene import read_scene
    from selenite.write_back import environments, surfaces
    from selenite.write_back import grids as grid_objects

    open_blend(str(folder / "scene.blend"), scripts=request["scripts"])
    scene = bpy.data.scenes[request["scene"]]
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    begin = time.perf_counter()
    wanted = RunRequest.from_json(request["run"])
    values = {parameters.split_name(name): tuple(v) for name, v in request["values"].items()}
    read = read_scene(scene, options=wanted.reading)
    write_back.write(scene, read.owners, values)
    shown = [surfaces.show(read, name, path) for name, path in request["surfaces"].items()]
    if request.get("environment"):
        shown.append(environments.show(scene, read, request["environment"]))
    read = read_scene(scene, options=wanted.reading)
    problems = list(read.problems)
    captures = read_captures(
        read,
        wanted.captures,
        wanted.settings.height,
        problems,
        [],
        packed_photos(),
        fitted_owners(read, wanted.unknowns),
    )
    if problems:
        raise BadInput(problems)
    taken = request["taken"]  # by photo: gain and alignment that a fit has found
    captures = [
        replace(one, **{name: tuple(found) for name, found in taken.get(one.id, {}).items()})
        for one in captures
    ]
    remarks = render_settings.remarks(scene, render_settings.contents_of(scene))
    grids = _grids(folder, request["grids"])
    # Selenite renders the grids inside their meshes, as they were fitted, Cycles Volume objects.
    native_scene = build_scene(with_grids(read, grids))
    shown += [grid_objects.show(scene, read, name, uses, folder) for name, uses in grids.items()]
    samples = max(1, round(wanted.settings.picture_spp / SEEDS))
    cameras = {camera.name: camera for camera in read.cameras}
    # Where one photo is cropped or aligned, each sets the lens of its camera.
    lenses: dict[str, str | CameraValues] = {item.id: item.camera for item in captures}
    if any(item.alignment != UNALIGNED or item.window != WHOLE for item in captures):
        for item in captures:
            window = moved_window(item)
            lenses[item.id] = cropped_camera(cameras[item.camera], item.aspect, window)
    stems = file_stems(item.id for item in captures)
    rows, pictures = {}, {}
    for index, capture in enumerate(captures):

        def note_part(text: str, share: float, done: int = index, name: str = capture.id) -> None:
            note((done + share) / len(captures), f"{text} of {name}")

        pixel_aspect = capture.pixel_aspect(cameras[capture.camera])
        rows[capture.id], pictures[capture.id] = _check(
            folder,
            scene,
            native_scene,
            capture,
            stems[capture.id],
            lenses[capture.id],
            pixel_aspect,
            wanted.settings,
            samples,
            note_part,
        )
    sheet.write(folder / "out" / "cycles_check.png", pictures, LARGEST_ERROR)
    return {
        "samples": samples * SEEDS,
        "seeds": SEEDS,
        "blender": bpy.app.version_string,
        "seconds": time.perf_counter() - begin,
        "photos": rows,
        "shown": shown,
        "render_settings": [item.as_json() for item in remarks],
    }


def _grids(
    folder: Path, entries: dict[str, dict[str, GridFile]]
) -> dict[str, dict[str, GridValues]]:
    """The fitted grids, material -> use -> grid."""
    import numpy as np

    from selenite import grid_files
    from selenite.scene_read.values import GridValues

    return {
        name: {
            use: GridValues(
                entry["name"],
                grid_files.read(str(folder / entry["file"])),
                np.array(entry["to_unit"], np.float64),
            )
            for use, entry in uses.items()
        }
        for name, uses in entries.items()
    }


def _check(
    folder: Path,
    scene: bpy.types.Scene,
    native_scene: Scene,
    capture: Capture,
    stem: str,
    camera: str | CameraValues,
    pixel_aspect: float,
    settings: FitSettings,
    samples: int,
    note: Callable[[str, float], None],
) -> tuple[CheckedPhoto, dict[str, np.ndarray]]:
    """(numbers of one photo, its tiles for the sheet); writes its pictures, named by `stem`."""
    import numpy as np

    from selenite import native
    from selenite.cycles_check.alignment import rolled
    from selenite.cycles_check.compare import Estimate, misfit
    from selenite.cycles_check.light_state import under_lights
    from selenite.cycles_check.render import estimate
    from selenite.fit.capture_render import evaluator

    height, width = capture.reference.shape[:2]
    note("Selenite's picture", 0.0)
    film = evaluator(native_scene, settings).picture(
        capture.view(of_file=False), samples * SEEDS, seed=settings.seed
    )
    ours, photo = Estimate.of_film(film), Estimate.exact(capture.reference)
    with under_lights(scene, capture.lights), rolled(scene, capture.camera, capture.alignment[2]):
        cycles = estimate(
            scene,
            camera,
            (width, height),
            samples,
            range(settings.seed, settings.seed + SEEDS),
            folder / "cycles.exr",
            lambda fraction: note("Cycles' picture", 0.2 + 0.8 * fraction),
            pixel_aspect,
        )
    cycles = cycles.shown(capture)
    counted = (capture.weight > 0)[..., None]
    against_ours = cycles.mean - ours.mean
    against_photo = (cycles.mean - photo.mean) * counted
    for name, pixels in (
        ("native", ours.mean),
        ("native_sem", np.sqrt(ours.variance)),
        ("cycles", cycles.mean),
        ("cycles_sem", np.sqrt(cycles.variance)),
        ("cycles_minus_native", against_ours),
        ("cycles_minus_photo", against_photo),
    ):
        pixels = np.ascontiguousarray(pixels, np.float32)
        native.image().write_exr(str(folder / "out" / f"{stem}_{name}.exr"), pixels)
    cycles_png = np.ascontiguousarray(cycles.mean, np.float32)
    native.image().write_png(str(folder / "out" / f"{stem}_cycles.png"), cycles_png)
    everywhere = np.ones(capture.weight.shape)
    row: CheckedPhoto = {
        "native_against_cycles": misfit(ours, cycles, everywhere),
        "cycles_against_photo": misfit(cycles, photo, capture.weight.astype(np.float64)),
        "native_against_photo": misfit(ours, photo, capture.weight.astype(np.float64)),
    }
    tiles = {
        "photo": photo.mean,
        "Selenite": ours.mean,
        "Cycles": cycles.mean,
        "|Cycles - Selenite|": np.abs(against_ours).mean(axis=-1),
        "|Cycles - photo|": np.abs(against_photo).mean(axis=-1),
    }
    return row, tiles
