# SPDX-License-Identifier: GPL-3.0-or-later
"""The result folder: complete under its name, or not there at all."""

from __future__ import annotations

import json
import math
import platform
import shutil
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__, mean_free_path, native
from ..atomic_files import write_json
from ..capture.prepared import Capture
from ..environments import sphere
from ..fit import trust
from ..fit.capture_render import alignment_of, as_found, evaluator
from ..fit.checkpoint import RESULT
from ..fit.diagnosis.gauge import gauges
from ..fit.fields import EnvironmentUnknown, FieldUnknown, environment
from ..fit.fields import seen as surfaces
from ..fit.job import fitted_values, scene_at
from ..fit.plan import FitPlan, paths_traced
from ..parameters import Values
from ..paths import file_stems
from . import aligned, gain_level, halves, hold_out
from .history_file import write_history
from .pictures import comparison, plots, sheet

SCHEMA = 1
#: Pictures of a result folder beside those of each photo.
SHEET, PLOTS = "contact_sheet.png", "plots.png"
#: A pixel of a photo in its eight pictures, well compressed; and what a file takes at least.
_BYTES_OF_PIXEL, _BYTES_OF_FILE = 30, 1000


def result_json(plan: FitPlan, result: dict[str, Any], host: str) -> dict[str, Any]:
    """The content of result.json; units are in it. Uncertainties are null where unknown."""
    values = fitted_values(plan, result)
    rows: dict[str, dict[str, Any]] = {}
    for item in plan.unknowns:
        rows[item.name] = {
            "initial": _plain(item.start),
            "value": _plain(values[item.owner, item.parameter.name]),
            "minimum": item.minimum,
            "maximum": item.maximum,
            **trust.entries(item, result),
            "unit": item.parameter.unit,
        }
        if item.parameter.name == "extinction":
            value = values[item.owner, item.parameter.name]
            rows[item.name]["mean_free_path"] = {
                "initial": list(mean_free_path.of(item.start, plan.millimetres).value),
                **mean_free_path.of(value, plan.millimetres).as_json(),
            }
    for field in plan.fields:
        found = result["fields_best"][field.name]
        rows[field.name] = {
            "initial": field.mean(field.values),
            "value": fitted_mean(field, result),
            "minimum": field.minimum,
            "maximum": field.maximum,
            **trust.UNKNOWN,
            "unit": field.UNIT,
            **field.about(found, result.get("coverage", {}).get(field.name)),
        }
        if (agreement := result.get("halves", {}).get(field.name)) is not None:
            rows[field.name]["halves"] = agreement.as_json()
    of_stages = {"stages": result["stages"]} if "stages" in result else {}
    if plan.request.staging:
        of_stages["staging"] = plan.request.staging
    return {
        "schema": SCHEMA,
        "versions": {
            "selenite": __version__,
            "blender": host,
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "seed": plan.request.settings.seed,
        "parameters": rows,
        "misfit": trust.misfit(result),
        "alternative_minima": trust.alternative_minima(result),
        "ambiguous": trust.ambiguous(result),
        "gauge": [one.as_json() for one in gauges(result)],
        "loss": _loss(result),
        "best_iteration": result["best_iteration"],
        "iterations": result["iterations"],
        "stopped_because": result["stopped_because"],
        "samples": result["samples"],
        "seconds": result["seconds"],
        "cpu_seconds": result["cpu_seconds"],
        "dropped": result["dropped"],
        "model": plan.model,
        "pictures": file_stems(item.id for item in plan.captures),
        "captures": {item.id: _capture_entry(item, result) for item in plan.captures},
        "hold_out": hold_out.report(result["hold_out"]) if result.get("hold_out") else None,
        "warnings": [*plan.warnings, *result.get("notes", ())],
    } | of_stages


def _loss(result: dict[str, Any]) -> dict[str, Any]:
    """Of the start and of the result, by the same weights and random numbers; null where it was not
    validated. model_error: what the residuals show, see docs/method/losses.md."""
    return {
        "start": result.get("start_validation"),
        "result": result.get("best_validation"),
        "standard_error": result.get("best_validation_standard_error"),
        "start_kept": bool(result.get("kept_start")),
        "model_error": result.get("model_error"),
    }


def _capture_entry(capture: Capture, result: dict[str, Any]) -> dict[str, Any]:
    """The same for each photo, so that a reader need not ask whether its gain or shift was free."""
    given = {"gain": list(capture.gain), "gain_interval_90": None, "shift": [0.0, 0.0, 0.0]}
    return given | found_of_photo(capture, result)


def found_of_photo(capture: Capture, result: dict[str, Any]) -> dict[str, Any]:
    """What the fit has found of a photo, and how much of it counts."""
    found: dict[str, Any] = dict(result.get("captures", {}).get(capture.id, {}))
    if "shift" in found:  # in pixels of the file
        height, width = capture.reference.shape[:2]
        across, down, roll = alignment_of(capture, result)
        columns, rows = capture.photo_size
        found["shift"] = [across * columns / width, down * rows / height, math.degrees(roll)]
        found["shift_believed"] = capture.id not in result.get("doubtful_shifts", ())
    if "unexplained" in found and not found["unexplained"]:
        found["unexplained"] = None  # noise may hide what is left
    return {**found, "mask_share": capture.mask_share, "isolated_light": capture.isolated}


def finished(
    plan: FitPlan,
    result: dict[str, Any],
    progress: Callable[[str, float], None] = lambda _text, _fraction: None,
) -> dict[str, Any]:
    """The result with what no photo sees of its images and meshes kept or filled, texels of the
    world's continued from the others, and with the keys `coverage` (see `fields.seen`) and
    `fitted_means`, of all texels before that. Renders where there are images. Unless it was stopped
    also wider intervals of gains beside fields, `halves` of the photos of each image, and
    `hold_out`: the photos that the fit has not seen beside their renders."""
    doubts = aligned.doubtful(plan.captures, result)
    notes = (*result.get("notes", ()), *aligned.sentences(doubts))
    result = _with_images(plan, result | {"doubtful_shifts": doubts, "notes": notes}, progress)
    if result.get("stopped") != native.core().StopReason.CANCELLED:
        result = gain_level.widened(plan, result, progress)
        result = result | {"halves": halves.of_images(plan, result, progress)}
    if not plan.hold_out or result.get("stopped") == native.core().StopReason.CANCELLED:
        return result
    settings = plan.request.settings
    rows = hold_out.compare_all(
        scene_at(plan, result), plan.hold_out, settings, settings.picture_spp, progress
    )
    return result | {"hold_out": rows}


def _with_images(
    plan: FitPlan, result: dict[str, Any], progress: Callable[[str, float], None]
) -> dict[str, Any]:
    if not any(item.kind.is_surface or item.kind.is_environment for item in plan.fields):
        return result
    means = {item.name: item.mean(result["fields_best"][item.name]) for item in plan.fields}
    scene = scene_at(plan, result)
    captures = [as_found(item, result) for item in plan.captures]
    final, coverage = surfaces.finished(
        plan.fields, result["fields_best"], scene, captures, progress
    )
    for item in plan.fields:
        if isinstance(item, EnvironmentUnknown):
            found = coverage[item.name] = environment.coverage(item, scene, captures)
            final[item.name] = sphere.continued(final[item.name], environment.seen(found))
    return result | {"fields_best": final, "coverage": coverage, "fitted_means": means}


def seconds_of_pictures(plan: FitPlan, result: dict[str, Any]) -> float:
    """How long the pictures of a result folder will take about, by the pace of the fit."""
    settings = plan.request.settings
    samples = 2 * settings.picture_spp * sum(item.weight.size for item in plan.captures)
    return float(samples * result["seconds"] / max(result["samples"], 1))


def write_results(
    plan: FitPlan,
    result: dict[str, Any],
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
        report = result_json(plan, result, host)
        write_json(partial / RESULT, report)
        write_json(partial / "run.json", plan.request.as_json())
        numbers = {item.name for item in plan.fields if item.values.shape[-1] == 1}
        write_history(partial / "history.csv", result["history"], numbers)
        for field in plan.fields:
            coverage = result.get("coverage", {}).get(field.name)
            field.write(partial, result["fields_best"][field.name], coverage)
            if (agreement := result.get("halves", {}).get(field.name)) is not None:
                agreement.write(partial / f"{field.stem}_halves.exr")
        log = _log(plan, report, result).encode(errors="backslashreplace")
        (partial / "log.txt").write_bytes(log)
        plots.write(partial / PLOTS, plan, result)
        if pictures:
            _write_pictures(plan, result, partial, progress)
        partial.rename(final)
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


def field_text(field: FieldUnknown, result: dict[str, Any]) -> str:
    """Means over the voxels or texels at the start and of the fitted values."""
    start, fitted = field_means(field, result)
    return f"mean {_text(start)} -> {_text(fitted)}"


def field_means(field: FieldUnknown, result: dict[str, Any]) -> tuple[Values, Values]:
    """Over the voxels or texels: of the start and of the fitted values."""
    return field.mean(field.values), fitted_mean(field, result)


def fitted_mean(field: FieldUnknown, result: dict[str, Any]) -> Values:
    """As in the history: of the texels as they were fitted, before `finished`."""
    means: dict[str, Values] = result.get("fitted_means", {})
    return means.get(field.name) or field.mean(result["fields_best"][field.name])


def _write_pictures(
    plan: FitPlan, result: dict[str, Any], folder: Path, progress: Callable[[str, float], None]
) -> None:
    """Per photo: initial, optimised, reference, error (absolute difference); and all of them on one
    sheet. What does not count is black in OpenEXR, marked in PNG. Both renders have the same seed
    and alignment, so that their difference is the fit's."""
    settings = plan.request.settings
    before, after = (evaluator(s, settings) for s in (plan.scene, scene_at(plan, result)))
    stems = file_stems(item.id for item in plan.captures)
    steps = 2 * len(plan.captures)
    rows = {}
    for index, capture in enumerate(plan.captures):
        stem, photo = stems[capture.id], as_found(capture, result).view()
        progress(f"initial picture of {capture.id}", 2 * index / steps)
        initial = before.picture(photo, settings.picture_spp, seed=settings.seed).image
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
    if result.get("hold_out"):
        hold_out.write_sheet(result["hold_out"], folder / hold_out.SHEET)


def _log(plan: FitPlan, report: dict[str, Any], result: dict[str, Any]) -> str:
    lines = [
        f"Selenite {__version__}, Blender {report['versions']['blender']}",
        f"Scene: {plan.request.scene}",
        f"Model: {plan.model}",
        f"Paths are traced {paths_traced(plan.scene)}",
        *(
            f"Photo {item.id}: {item.photo}, {item.photo_size[0]} x {item.photo_size[1]} "
            f"compared at {item.reference.shape[1]} x {item.reference.shape[0]}"
            for item in plan.captures
        ),
        f"Settings: {json.dumps(plan.request.settings.as_json())}",
        *(f"Warning: {text}" for text in report["warnings"]),
        *([f"Stages: {plan.request.staging}"] if plan.request.staging else []),
        *(
            f"Stage {number} '{stage['name']}': {', '.join(stage['parameters'])}; "
            f"{stage['iterations']} iterations, {stage['seconds']:.2f} s, "
            f"{stage['stopped_because']}"
            for number, stage in enumerate(report.get("stages", ()), start=1)
        ),
        f"Stopped because: {report['stopped_because']} after {report['iterations']} iterations, "
        f"{report['seconds']:.2f} s ({report['cpu_seconds']:.2f} s of CPU)",
        f"Best iteration: {report['best_iteration']}",
        *(
            f"{name}: {row['initial']} -> {row['value']}"
            for name, row in report["parameters"].items()
        ),
        *trust.sentences(plan, result),
        *of_photos(result),
    ]
    return "\n".join(lines) + "\n"


def of_photos(result: dict[str, Any]) -> list[str]:
    """How far halves of the photos agree on an image, and how photos that were held out look."""
    found = [item.sentence(name) for name, item in result.get("halves", {}).items()]
    return found + (hold_out.sentences(result["hold_out"]) if result.get("hold_out") else [])


def _plain(values: Values) -> float | list[float]:
    """A number, or a list for a colour."""
    return values[0] if len(values) == 1 else list(values)


def _text(values: Values) -> str:
    return ", ".join(f"{value:.4f}" for value in values)


def new_folder(parent: Path, suffix: str = "") -> Path:
    """`parent/<date>_<time><suffix>`, or with a number where that is taken; it is not made."""
    name = datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    candidate, number = parent / f"{name}{suffix}", 2
    while candidate.exists() or (parent / f".{candidate.name}.partial").exists():
        candidate, number = parent / f"{name}-{number}{suffix}", number + 1
    return candidate
