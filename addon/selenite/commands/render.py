# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite render`: one picture of one camera, or what a fit compares with a photo."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from .. import native
from ..fit_run.answer.fitted_scene import at_result
from ..fit_run.captures.light_states import AS_IN_SCENE, described
from ..fit_run.captures.prepared import Capture
from ..fit_run.captures.render import UNALIGNED, Alignment, shown, shown_noise, under_lights
from ..parameters import Values
from ..paths import absolute
from ..problems import BadInput, Problem, refused
from ..scene_read.values import SceneValues
from . import arguments
from .capture_view import capture_view
from .scene import (
    RENDER,
    active_camera,
    camera_of,
    native_scene,
    open_scene,
    picture_frame,
    picture_size,
    reading_of,
)
from .terminal import say


@dataclass(frozen=True)
class View:
    """What is rendered. capture: the photo that shows it, None for a plain camera."""

    camera: str
    size: tuple[int, int]
    frame: tuple[float, int, int]
    lights: Mapping[str, Any] = field(default_factory=lambda: dict(AS_IN_SCENE))
    alignment: Alignment = UNALIGNED
    capture: Capture | None = None


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Renders and writes --out (OpenEXR: linear; PNG: sRGB) and --sem, the standard error."""
    problems: list[Problem] = []
    out = arguments.output_file(args.out, (".exr", ".png"), problems)
    sem = arguments.optional_file(args.sem, (".exr",), problems)
    changes = arguments.assignments(args.set, problems)
    if sem is not None and sem == out:
        cause, cure = "the picture goes there", "give another name to --sem"
        problems.append(Problem(f"File '{args.sem}'", cause, cure))
    scene_in_blender, values = open_scene(args.scene, reading_of(args))
    arguments.render_numbers(args, problems)
    values.physical_refraction = args.physical_refraction
    if args.result is not None:
        values, changes = _at_result(args, values, changes, problems)
    view = None
    if args.captures is not None or args.capture is not None:
        found = capture_view(args, values, problems)
        if found is not None:
            capture, alignment = found
            height, width = capture.reference.shape[:2]
            view = View(
                capture.camera, (width, height), capture.frame, capture.lights, alignment,
                capture,
            )  # fmt: skip
    else:
        active = active_camera(scene_in_blender)
        camera = camera_of(values, args.camera, active, problems)
        size = picture_size(camera, args.width, args.height, problems)
        if camera is not None:
            view = View(camera.name, size, picture_frame(camera, args.width, args.height))
    scene = native_scene(values.without_shut(changes), changes, problems)
    if view is None:  # cannot be: native_scene raises the problem that was found
        raise BadInput(problems)
    width, height = view.size
    say(f"rendering {width} x {height}, {args.spp} samples per pixel")
    if view.capture is not None:
        say(
            f"photo {view.capture.id}: camera '{view.camera}', {described(view.lights)}, "
            f"{_gain(view.capture)}{_shift(view)}"
        )
    with refused(*RENDER):
        film = native.core().render(
            under_lights(scene, view.lights),
            view.camera,
            width,
            height,
            args.spp,
            seed=args.seed,
            depth=args.depth,
            threads=args.threads,
            lanes=args.lanes,
            frame=view.frame,
            alignment=view.alignment,
        )
    picture, deviation = film.image, film.standard_error
    if view.capture is not None:
        picture, deviation = shown(picture, view.capture), shown_noise(deviation, view.capture)
    image = native.image()
    (image.write_exr if out.suffix.lower() == ".exr" else image.write_png)(str(out), picture)
    if sem is not None:
        image.write_exr(str(sem), deviation)
    say(f"wrote {out} in {film.seconds:.1f} s")
    report = {
        "camera": view.camera,
        "width": width,
        "height": height,
        "spp": film.spp,
        "seed": args.seed,
        "out": str(out),
        "sem": str(sem) if sem is not None else None,
        "mean_image": picture.mean(axis=(0, 1), dtype=float).tolist(),
        "dropped": film.dropped,
        "seconds": film.seconds,
        "cpu_seconds": film.cpu_seconds,
    }
    if view.capture is not None:
        report |= {
            "capture": view.capture.id, "gain": list(view.capture.gain),
            "lights": described(view.lights), "alignment": list(view.alignment),
        }  # fmt: skip
    return report


def _at_result(
    args: argparse.Namespace,
    values: SceneValues,
    changes: Mapping[arguments.Key, Values],
    problems: list[Problem],
) -> tuple[SceneValues, dict[arguments.Key, Values]]:
    """The scene at what the fit of --result has found, and --set over it; its photos, where none
    are named."""
    if args.capture is not None and args.captures is None:
        args.captures = args.result
    try:
        values, fitted = at_result(values, absolute(args.result))
    except BadInput as error:
        problems += error.problems
        return values, dict(changes)
    return values, fitted | dict(changes)


def _gain(capture: Capture) -> str:
    numbers = ", ".join(f"{number:.4g}" for number in dict.fromkeys(capture.gain))
    return f"gain {numbers}" if len(set(capture.gain)) == 1 else f"gain {capture.gain}"


def _shift(view: View) -> str:
    if view.alignment == UNALIGNED:
        return ""
    across, down, roll = view.alignment
    return f", moved by {across:.2f} and {down:.2f} pixels, rolled by {math.degrees(roll):.2f} deg"
