# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite render`: one picture of one camera."""

from __future__ import annotations

import argparse
from typing import Any

from .. import native
from ..problems import BadInput, Problem, refused
from . import arguments
from .scene import RENDER, camera_of, native_scene, open_scene, picture_frame, picture_size
from .terminal import say


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Renders and writes --out (OpenEXR: linear; PNG: sRGB) and --sem, the standard error."""
    problems: list[Problem] = []
    out = arguments.output_file(args.out, (".exr", ".png"), problems)
    sem = arguments.optional_file(args.sem, (".exr",), problems)
    changes = arguments.assignments(args.set, problems)
    if sem is not None and sem == out:
        cause, cure = "the picture goes there", "give another name to --sem"
        problems.append(Problem(f"File '{args.sem}'", cause, cure))
    _, values = open_scene(args.scene)
    arguments.render_numbers(args, problems)
    values.physical_refraction = args.physical_refraction
    camera = camera_of(values, args.camera, problems)
    width, height = picture_size(camera, args.width, args.height, problems)
    scene = native_scene(values, changes, problems)
    if camera is None:  # cannot be: native_scene raises the problem that camera_of has found
        raise BadInput(problems)
    say(f"rendering {width} x {height}, {args.spp} samples per pixel")
    with refused(*RENDER):
        film = native.core().render(
            scene,
            camera.name,
            width,
            height,
            args.spp,
            seed=args.seed,
            depth=args.depth,
            threads=args.threads,
            lanes=args.lanes,
            frame=picture_frame(camera, args.width, args.height),
        )
    image = native.image()
    (image.write_exr if out.suffix.lower() == ".exr" else image.write_png)(str(out), film.image)
    if sem is not None:
        image.write_exr(str(sem), film.standard_error)
    say(f"wrote {out} in {film.seconds:.1f} s")
    return {
        "camera": camera.name,
        "width": width,
        "height": height,
        "spp": film.spp,
        "seed": args.seed,
        "out": str(out),
        "sem": str(sem) if sem is not None else None,
        "mean_image": film.image.mean(axis=(0, 1), dtype=float).tolist(),
        "dropped": film.dropped,
        "seconds": film.seconds,
        "cpu_seconds": film.cpu_seconds,
    }
