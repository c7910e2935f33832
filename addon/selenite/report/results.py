# SPDX-License-Identifier: GPL-3.0-or-later
"""The result folder: complete under its name, or not there at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import __version__, native
from ..atomic_files import take_place, write_json
from ..environments import sphere
from ..fit import trust
from ..fit.capture_render import as_found, evaluator
from ..fit.checkpoint import RESULT
from ..fit.fields import EnvironmentUnknown, FieldUnknown, environment
from ..fit.fields import seen as surfaces
from ..fit.plan import FitPlan, paths_traced
from ..parameters import Values
from ..paths import file_stems
from . import aligned, gain_level, halves, hold_out
from .finished_fit import FinishedFit
from .history_file import write_history
from .pictures import comparison, moments, plots, sheet
from .result_file import ResultFile

if TYPE_CHECKING:
    from .._core import FitResult

#: Pictures of a result folder beside those of each photo.
SHEET, PLOTS = "contact_sheet.png", "plots.png"
#: A pixel of a photo in its eight pictures, well compressed; and what a file takes at least.
_BYTES_OF_PIXEL, _BYTES_OF_FILE = 30, 1000


def finished(
    plan: FitPlan,
    result: FinishedFit,
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> FinishedFit:
    """With what no photo sees of its images and meshes kept or filled, texels of the world's
    continued from the others, and what photos see of each (see `fields.seen`). Renders where
    there are images. Unless it was stopped also wider intervals of gains beside fields, how far
    halves of the photos agree, and the photos that the fit has not seen beside their renders."""
    doubts = aligned.doubtful(plan.captures, result.fit)
    result = replace(
        result, doubtful_shifts=doubts, notes=(*result.notes, *aligned.sentences(doubts))
    )
    result = _with_images(plan, result, progress)
    if trust.cancelled(result.fit):
        return result
    result = gain_level.widened(plan, result, progress)
    result = replace(
        result, halves=halves.of_images(plan, result.fit, result.scene(plan), progress)
    )
    if not plan.hold_out:
        return result
    settings = plan.request.settings
    rows = hold_out.compare_all(
        result.scene(plan), plan.hold_out, settings, settings.picture_spp, progress
    )
    return replace(result, hold_out=rows)


def _with_images(
    plan: FitPlan, result: FinishedFit, progress: Callable[[str, float], None]
) -> FinishedFit:
    if not any(item.kind.is_surface or item.kind.is_environment for item in plan.fields):
        return result
    best = result.fit.fields_best
    means = {item.name: item.mean(best[item.name]) for item in plan.fields}
    scene = result.scene(plan)
    captures = [as_found(item, result.fit) for item in plan.captures]
    final, coverage = surfaces.finished(plan.fields, best, scene, captures, progress)
    for item in plan.fields:
        if isinstance(item, EnvironmentUnknown):
            found = coverage[item.name] = environment.coverage(item, scene, captures)
            final[item.name] = sphere.continued(final[item.name], environment.seen(found))
    return replace(result, finished_fields=final, coverage=coverage, fitted_means=means)


def seconds_of_pictures(plan: FitPlan, fit: FitResult) -> float:
    """How long the pictures of a result folder will take about, by the pace of the fit."""
    settings = plan.request.settings
    spp = settings.picture_spp + moments.start_spp(settings)
    samples = spp * sum(item.weight.size for item in plan.captures)
    return samples * fit.seconds / max(fit.samples, 1)


def write_results(
    plan: FitPlan,
    result: FinishedFit,
    parent: Path,
    host: str,
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
    *,
    pictures: bool = True,
) -> Path:
    """Renders the pictures and writes `parent/<date>_<time>/`; returns the folder. result: see
    `finished`.

    Everything is written into a hidden folder beside it that is renamed at the end. Raises OSError.
    """
    parent.mkdir(parents=True, exist_ok=True)
    final = new_folder(parent)
    partial = parent / f".{final.name}.partial"
    partial.mkdir()
    try:
        report = ResultFile.of(plan, result, host)
        write_json(partial / RESULT, report.as_json())
        write_json(partial / "run.json", plan.request.as_json())
        numbers = {item.name for item in plan.fields if item.values.shape[-1] == 1}
        write_history(partial / "history.csv", result.fit.history, numbers)
        for field in plan.fields:
            coverage = result.coverage.get(field.name)
            field.write(partial, result.fields[field.name], coverage)
            if (agreement := result.halves.get(field.name)) is not None:
                agreement.write(partial / f"{field.stem}_halves.exr")
        log = _log(plan, report, result).encode(errors="backslashreplace")
        (partial / "log.txt").write_bytes(log)
        plots.write(partial / PLOTS, plan, result.fit)
        if pictures:
            _write_pictures(plan, result, partial, progress)
        take_place(partial, final)
    finally:
        if partial.exists():
            shutil.rmtree(partial, ignore_errors=True)
    return final


def size_of(plan: FitPlan) -> int:
    """Bytes that `write_results` takes at least, about."""
    pixels = sum(item.weight.size for item in plan.captures)
    files = 6 + 8 * len(plan.captures)
    fields = sum(item.values.nbytes for item in plan.fields)
    return pixels * _BYTES_OF_PIXEL + files * _BYTES_OF_FILE + fields


def field_text(field: FieldUnknown, result: FinishedFit) -> str:
    """Means over the voxels or texels at the start and of the fitted values."""
    return f"mean {_text(field.mean(field.values))} -> {_text(result.mean(field))}"


def _write_pictures(
    plan: FitPlan, result: FinishedFit, folder: Path, progress: Callable[[str, float], None]
) -> None:
    """Per photo: initial, optimised, reference, error (absolute difference); and all of them on one
    sheet. What does not count is black in OpenEXR, marked in PNG. Both renders have the same seed
    and alignment; the initial one has fewer samples."""
    settings = plan.request.settings
    before, after = (evaluator(s, settings) for s in (plan.scene, result.scene(plan)))
    stems = file_stems(item.id for item in plan.captures)
    steps = 2 * len(plan.captures)
    rows = {}
    for index, capture in enumerate(plan.captures):
        stem, photo = stems[capture.id], as_found(capture, result.fit).view()
        progress(f"initial picture of {capture.id}", 2 * index / steps)
        initial = before.picture(photo, moments.start_spp(settings), seed=settings.seed).image
        progress(f"optimised picture of {capture.id}", (2 * index + 1) / steps)
        final = after.picture(photo, settings.picture_spp, seed=settings.seed).image
        error = np.abs(final - capture.reference)
        counts = (capture.weight > 0)[..., None]
        for name, pixels in (
            ("initial", initial),
            ("optimised", final),
            ("reference", capture.reference),
            ("error", error),
        ):
            black = np.ascontiguousarray(np.where(counts, pixels, 0), np.float32)
            native.image().write_exr(str(folder / f"{stem}_{name}.exr"), black)
            shown = capture.reference if name == "error" else pixels
            outside = comparison.marked(shown, capture.weight)
            seen = np.ascontiguousarray(np.where(counts, pixels, outside), np.float32)
            native.image().write_png(str(folder / f"{stem}_{name}.png"), seen)
        rows[capture.id] = sheet.small(capture.reference, capture.weight, initial, final)
    sheet.of_fit(rows, comparison.ERROR_SCALE).write(folder / SHEET)
    if result.hold_out:
        hold_out.write_sheet(result.hold_out, folder / hold_out.SHEET)


def _log(plan: FitPlan, report: ResultFile, result: FinishedFit) -> str:
    lines = [
        f"Selenite {__version__}, Blender {report.versions['blender']}",
        f"Scene: {plan.request.scene}",
        f"Model: {plan.model}",
        f"Paths are traced {paths_traced(plan.scene)}",
        *(
            f"Photo {item.id}: {item.photo}, {item.photo_size[0]} x {item.photo_size[1]} "
            f"compared at {item.reference.shape[1]} x {item.reference.shape[0]}"
            for item in plan.captures
        ),
        f"Settings: {json.dumps(plan.request.settings.as_json())}",
        *(f"Warning: {text}" for text in report.warnings),
        *(
            f"Stage {number} '{stage.name}': {', '.join(stage.parameters)}; "
            f"{stage.iterations} iterations, {stage.seconds:.2f} s, {stage.stopped_because}"
            for number, stage in enumerate(report.stages or (), start=1)
        ),
        f"Stopped because: {report.stopped_because} after {report.iterations} iterations, "
        f"{report.seconds:.2f} s ({report.cpu_seconds:.2f} s of CPU in renders)",
        f"Best iteration: {report.best_iteration}",
        *(f"{name}: {row.initial} -> {row.value}" for name, row in report.parameters.items()),
        *trust.sentences(plan, result.fit),
        *of_photos(result),
    ]
    return "\n".join(lines) + "\n"


def of_photos(result: FinishedFit) -> list[str]:
    """How far halves of the photos agree on an image, and how photos that were held out look."""
    found = [item.sentence(name) for name, item in result.halves.items()]
    if result.hold_out:
        found.append(hold_out.Comparison(result.hold_out).sentence())
    return found


def _text(values: Values) -> str:
    return ", ".join(f"{value:.4f}" for value in values)


def new_folder(parent: Path, suffix: str = "") -> Path:
    """`parent/<date>_<time><suffix>`, or with a number where that is taken; it is not made."""
    name = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    candidate, number = parent / f"{name}{suffix}", 2
    while candidate.exists() or (parent / f".{candidate.name}.partial").exists():
        candidate, number = parent / f"{name}-{number}{suffix}", number + 1
    return candidate
