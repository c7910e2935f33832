# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite gradient`: a picture with its derivatives, and what an iteration costs."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .. import native, parameters
from ..paths import file_stems
from ..problems import BadInput, Problem, listed, refused
from ..scene_read.values import SceneValues
from . import arguments
from .scene import (
    RENDER,
    active_camera,
    camera_of,
    find_constant,
    native_scene,
    open_scene,
    picture_frame,
    picture_size,
    reading_of,
)
from .terminal import bar, say

if TYPE_CHECKING:
    from .._core import Film, Photo

#: A base colour's image, by whose texels the derivative is taken.
TEXTURE = "base_color_texture"


def run(args: argparse.Namespace) -> dict[str, object]:
    """Renders with derivatives, then --repeat times once more to measure an iteration."""
    started = time.perf_counter()
    problems: list[Problem] = []
    keys = arguments.names(args.parameter, problems)
    changes = arguments.assignments(args.set, problems)
    wanted_folder = args.out_dir is not None
    folder = arguments.output_folder(args.out_dir, problems) if wanted_folder else None
    scene_in_blender, values = open_scene(args.scene, reading_of(args))
    arguments.render_numbers(args, problems)
    values.physical_refraction = args.physical_refraction
    textured = _textured(values, keys, problems)
    found = [find_constant(values, *key, problems) for key in keys if key[1] != TEXTURE]
    wanted = [(owner.name, parameter.name) for owner, parameter in filter(None, found)]
    camera = camera_of(values, args.camera, active_camera(scene_in_blender), problems)
    width, height = picture_size(camera, args.width, args.height, problems)
    scene = native_scene(values, changes, problems)
    if camera is None:  # cannot be: native_scene raises the problem that camera_of has found
        raise BadInput(problems)

    core = native.core()
    frame = picture_frame(camera, args.width, args.height)
    usual = {"depth": args.depth, "threads": args.threads, "frame": frame}
    with refused(*RENDER):  # once, as a fit does, so that no iteration pays for it
        scene = core.decide_aims(scene, camera.name, width, height, parameters=wanted, **usual)
    evaluator = core.Evaluator(
        scene, depth=args.depth, threads=args.threads, lanes=0 if textured else args.lanes
    )
    view = core.Photo(camera.name, size=(width, height), frame=frame)

    def by_texels(
        owner: str, photo: Photo, seed: int, loss: str = "mean"
    ) -> tuple[Film, NDArray[np.float64]]:
        with refused(*RENDER):
            return evaluator.gradient(photo, owner, TEXTURE, args.spp, loss=loss, seed=seed)

    def render(seed: int) -> Film:
        with refused(*RENDER):
            return evaluator.picture(view, args.spp, seed=seed, parameters=wanted)

    film, texels = by_texels(textured, view, args.seed) if textured else (render(args.seed), None)
    compared = core.Photo(camera.name, film.image, frame=frame)
    iteration = (
        (lambda seed: by_texels(textured, compared, seed, "squared_error"))
        if textured
        else (lambda seed: _squared_error_gradient(render(seed), film.image))
    )
    costs = []
    with bar("measuring") as shown:
        for index in range(args.repeat):
            shown.update(index / args.repeat)
            costs.append(_cpu_seconds(iteration, args.seed + 1 + index))
    mean, mean_error = _mean(film.image, film.standard_error)
    derivatives = _derivatives(film)
    report: dict[str, object] = {
        "camera": camera.name,
        "width": width,
        "height": height,
        "spp": film.spp,
        "lanes": film.lanes,
        "seed": args.seed,
        "mean_image": mean,
        "mean_image_standard_error": mean_error,
        "derivatives": derivatives,
        "iteration_cpu_seconds": costs,
        "dropped": film.dropped,
        "seconds": 0.0,
    }
    if folder is not None:
        files = _write(film, folder)
        if texels is not None:
            name = f"{file_stems([str(textured)])[str(textured)]}_{TEXTURE}_texels.exr"
            native.image().write_exr(str(folder / name), texels.astype(np.float32))
            files.append(name)
        report["files"] = files
    report["seconds"] = time.perf_counter() - started
    for name, row in derivatives.items():
        for component, slope in enumerate(row["value"]):
            say(f"d mean / d {name}[{component}] = {', '.join(f'{x:.6g}' for x in slope)}")
    return report


def _textured(
    values: SceneValues, keys: Sequence[tuple[str, str]], problems: list[Problem]
) -> str | None:
    """The material whose base colour's image is differentiated by, if one is asked for."""
    owners = [owner for owner, name in keys if name == TEXTURE]
    if not owners:
        return None
    title = f"Parameter '{parameters.join_name(owners[0], TEXTURE)}'"
    if len(keys) > 1:
        cause = "its derivatives are by every texel, and cannot be given with others"
        problems.append(Problem(title, cause, "name it alone"))
    images = [
        item.name
        for item in values.materials
        if "base_color" in item.maps and item.maps["base_color"].texture
    ]
    if owners[0] not in images:
        cause = f"no material '{owners[0]}' takes its base colour from an image"
        cure = f"use one of {listed(images)}" if images else "name base_color, or link an image"
        problems.append(Problem(title, cause, cure))
    return owners[0]


def _cpu_seconds(iteration: Callable[[int], object], seed: int) -> float:
    started = time.process_time()
    iteration(seed)
    return time.process_time() - started


def _squared_error_gradient(film: Film, reference: np.ndarray) -> np.ndarray:
    """Gradient of the mean squared error, from a picture with its Jacobian."""
    residual = (film.image - reference).ravel()
    # not by BLAS: its threads go on spinning, and their time would count
    jacobian = film.jacobian.reshape(len(film.unknowns), -1)
    return np.einsum("ij,j->i", jacobian, residual) * (2 / residual.size)


def _mean(image: np.ndarray, standard_error: np.ndarray) -> tuple[list[float], list[float]]:
    """Mean over the pixels, which are independent, and its standard error; per channel."""
    count = image.shape[0] * image.shape[1]
    variance = np.square(standard_error, dtype=np.float64).sum(axis=(0, 1))
    mean = image.mean(axis=(0, 1), dtype=np.float64)
    return mean.tolist(), (np.sqrt(variance) / count).tolist()


def _derivatives(film: Film) -> dict[str, dict[str, list[list[float]]]]:
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


def _write(film: Film, folder: Path) -> list[str]:
    """image.exr and per unknown OWNER_PARAMETER_COMPONENT.exr, each with its standard error."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = {"image": (film.image, film.standard_error)}
    for index, (owner, parameter, component) in enumerate(film.unknowns):
        rows = (film.jacobian[index], film.jacobian_standard_error[index])
        pictures[f"{owner}_{parameter}_{component}"] = rows
    stems = file_stems(pictures)
    names = []
    for title, (value, error) in pictures.items():
        name = stems[title]
        for suffix, pixels in (("", value), ("_sem", error)):
            path = folder / f"{name}{suffix}.exr"
            native.image().write_exr(str(path), np.ascontiguousarray(pixels, np.float32))
            names.append(path.name)
    return names
