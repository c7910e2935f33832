# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite render`: one picture of one camera, or what a fit compares with a photo."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping

from .. import native
from ..capture.light_states import described
from ..capture.prepared import UNALIGNED, Capture
from ..parameters import Values
from ..paths import absolute
from ..problems import BadInput, Problem, refused
from ..report.fitted_scene import at_result
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


def run(args: argparse.Namespace) -> dict[str, object]:
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
    capture, photo = None, None
    if args.captures is not None or args.capture is not None:
        capture = capture_view(args, values, problems)
    else:
        active = active_camera(scene_in_blender)
        camera = camera_of(values, args.camera, active, problems)
        size = picture_size(camera, args.width, args.height, problems)
        if camera is not None:
            frame = picture_frame(camera, args.width, args.height)
            photo = native.core().Photo(camera.name, size=size, frame=frame)
    scene = native_scene(values.without_shut(changes), changes, problems)
    if capture is not None:
        photo = capture.view()
    if photo is None:  # cannot be: native_scene raises the problem that was found
        raise BadInput(problems)
    width, height = photo.size
    say(f"rendering {width} x {height}, {args.spp} samples per pixel")
    if capture is not None:
        say(
            f"photo {capture.id}: camera '{capture.camera}', {described(capture.lights)}, "
            f"{_gain(capture)}{_shift(capture)}"
        )
    with refused(*RENDER):
        film = (
            native.core()
            .Evaluator(scene, depth=args.depth, threads=args.threads, lanes=args.lanes)
            .picture(photo, args.spp, seed=args.seed)
        )
    picture, deviation = film.image, film.standard_error
    image = native.image()
    (image.write_exr if out.suffix.lower() == ".exr" else image.write_png)(str(out), picture)
    if sem is not None:
        image.write_exr(str(sem), deviation)
    say(f"wrote {out} in {film.seconds:.1f} s")
    report = {
        "camera": photo.camera,
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
    if capture is not None:
        report |= {
            "capture": capture.id, "gain": list(capture.gain),
            "lights": described(capture.lights), "alignment": list(capture.alignment),
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


def _shift(capture: Capture) -> str:
    if capture.alignment == UNALIGNED:
        return ""
    across, down, roll = capture.alignment
    return f", moved by {across:.2f} and {down:.2f} pixels, rolled by {math.degrees(roll):.2f} deg"
