# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite gradient`: a picture with its derivatives, and what an iteration costs."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

from .. import native, parameters
from ..problems import BadInput, Problem
from . import arguments
from .scene import camera_of, find_constant, native_scene, open_scene, picture_frame, picture_size
from .terminal import bar, say


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Renders with derivatives, then --repeat times once more to measure an iteration."""
    started = time.perf_counter()
    problems: list[Problem] = []
    keys = arguments.names(args.parameter, problems)
    changes = arguments.assignments(args.set, problems)
    folder = arguments.output_folder(args.out_dir, problems) if args.out_dir else None
    _, values = open_scene(args.scene)
    values.physical_refraction = args.physical_refraction
    found = [find_constant(values, owner, name, problems) for owner, name in keys]
    wanted = [(owner.name, parameter.name) for owner, parameter in filter(None, found)]
    camera = camera_of(values, args.camera, problems)
    width, height = picture_size(camera, args.width, args.height, problems)
    scene = native_scene(values, changes, problems)
    if camera is None:  # cannot be: native_scene raises the problem that camera_of has found
        raise BadInput(problems)

    def render(seed: int) -> Any:  # noqa: ANN401 - a native Film has no Python type
        return native.core().render(
            scene,
            camera.name,
            width,
            height,
            args.spp,
            seed=seed,
            depth=args.depth,
            threads=args.threads,
            frame=picture_frame(camera, args.width, args.height),
            parameters=wanted,
        )

    film = render(args.seed)
    costs = []
    with bar("measuring") as shown:
        for index in range(args.repeat):
            shown.update(index / args.repeat)
            costs.append(
                _iteration_cpu_seconds(lambda i=index: render(args.seed + 1 + i), film.image)
            )
    mean, mean_error = _mean(film.image, film.standard_error)
    report = {
        "camera": camera.name,
        "width": width,
        "height": height,
        "spp": film.spp,
        "seed": args.seed,
        "mean_image": mean,
        "mean_image_standard_error": mean_error,
        "derivatives": _derivatives(film),
        "iteration_cpu_seconds": costs,
        "dropped": film.dropped,
        "seconds": 0.0,
    }
    if folder is not None:
        report["files"] = _write(film, folder)
    report["seconds"] = time.perf_counter() - started
    for name, row in report["derivatives"].items():
        for component, slope in enumerate(row["value"]):
            say(f"d mean / d {name}[{component}] = {', '.join(f'{x:.6g}' for x in slope)}")
    return report


def _iteration_cpu_seconds(render: Any, reference: np.ndarray) -> float:  # noqa: ANN401
    """CPU seconds of one picture with Jacobian and the gradient of its mean squared error."""
    started = time.process_time()
    film = render()
    residual = (film.image - reference).ravel()
    # not by BLAS: its threads go on spinning, and their time would count
    jacobian = film.jacobian.reshape(len(film.unknowns), -1)
    _ = np.einsum("ij,j->i", jacobian, residual) * (2 / residual.size)
    return time.process_time() - started


def _mean(image: np.ndarray, standard_error: np.ndarray) -> tuple[list[float], list[float]]:
    """Mean over the pixels, which are independent, and its standard error; per channel."""
    count = image.shape[0] * image.shape[1]
    variance = np.square(standard_error, dtype=np.float64).sum(axis=(0, 1))
    mean = image.mean(axis=(0, 1), dtype=np.float64)
    return mean.tolist(), (np.sqrt(variance) / count).tolist()


def _derivatives(film: Any) -> dict[str, dict[str, list[list[float]]]]:  # noqa: ANN401
    """name -> {"value": [[r, g, b] per component], "standard_error": the same}."""
    rows: dict[str, dict[str, list[list[float]]]] = {}
    jacobian, error = film.jacobian, film.jacobian_standard_error
    for index, (owner, parameter, _component) in enumerate(film.unknowns):
        name = parameters.join_name(owner, parameter)
        row = rows.setdefault(name, {"value": [], "standard_error": []})
        value, standard_error = _mean(jacobian[index], error[index])
        row["value"].append(value)
        row["standard_error"].append(standard_error)
    return rows


def _write(film: Any, folder: Path) -> list[str]:  # noqa: ANN401
    """image.exr and per unknown OWNER_PARAMETER_COMPONENT.exr, each with its standard error."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = {"image": (film.image, film.standard_error)}
    for index, (owner, parameter, component) in enumerate(film.unknowns):
        safe = "".join(c if c.isalnum() or c in "-." else "_" for c in owner)
        rows = (film.jacobian[index], film.jacobian_standard_error[index])
        pictures[f"{safe}_{parameter}_{component}"] = rows
    names = []
    for name, (value, error) in pictures.items():
        for suffix, pixels in (("", value), ("_sem", error)):
            path = folder / f"{name}{suffix}.exr"
            native.image().write_exr(str(path), np.ascontiguousarray(pixels, np.float32))
            names.append(path.name)
    return names
