# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite demo`: the README's main job on a scene that is built by script.

A scene with a dark opaque material, two photos that Cycles rendered of it at known values -> fit ->
values written back into the Principled BSDF -> the written-back file rendered by Cycles -> a table
and a contact sheet.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from . import native
from .commands.terminal import say, table
from .problems import BadInput, Problem

SCENES = Path(__file__).resolve().parents[2] / "scenes"
NAME = "jade_pendant"
#: Largest permitted error of each parameter: what the demo promises.
LIMITS = {"base_color": 0.03, "roughness": 0.05, "transmission": 0.05, "ior": 0.05}
CYCLES_SAMPLES = 128


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Fits the demo scene, writes everything to --out, returns the report."""
    from .commands import fit

    scene, truth = _scene()
    out = Path(args.out).resolve()
    out.mkdir(parents=True, exist_ok=True)
    start_file, fitted_file = out / "start.blend", out / "fitted.blend"
    say("building the scene with its dark opaque start")
    scene.save_start(start_file)
    photos = [f"--photo={c}={SCENES / NAME / c}.png" for c in truth["cameras"]]
    command = ["fit", str(start_file), *photos]
    command += [f"--fit={truth['material']}:{','.join(truth['parameters'])}"]
    command += [f"--out={out}", f"--save={fitted_file}"]
    begin = time.perf_counter()
    report = fit.run(args.parser.parse_args(command))
    seconds = time.perf_counter() - begin

    rows = _rows(report, truth)
    say("rendering the written-back file with Cycles")
    folder = Path(report["folder"])
    pictures = _pictures(folder, fitted_file, truth["cameras"])
    sheet = out / "contact_sheet.png"
    _contact_sheet(pictures, sheet)
    table(
        ("parameter", "start", "fitted", "true", "error", "permitted", ""),
        [
            (r["name"], *(f"{r[k]:.4f}" for k in ("start", "fitted", "true", "error", "permitted")),
             "good" if r["good"] else "MISSED")
            for r in rows
        ],
    )  # fmt: skip
    misfit = {c: _misfit(p["cycles"], p["photo"]) for c, p in pictures.items()}
    for camera, value in misfit.items():
        say(
            f"{camera}: Cycles with the fitted values against the photo: "
            f"bias {100 * value['relative_bias']:+.2f} %, RMSE {100 * value['relative_rmse']:.2f} %"
            " (noise of both included)"
        )
    good = all(row["good"] for row in rows)
    say(f"{'all values within limits' if good else 'some values miss their limits'}; "
        f"{seconds:.0f} s for the fit; {sheet}")  # fmt: skip
    return {
        "good": good,
        "seconds": seconds,
        "parameters": rows,
        "cycles_against_photo": misfit,
        "contact_sheet": str(sheet),
        "fitted": str(fitted_file),
        "fit": report,
    }


def _scene() -> tuple[ModuleType, dict[str, Any]]:
    truth = SCENES / NAME / "truth.json"
    if not truth.is_file():
        cure = "run it in a checkout of Selenite; the demo scenes are not part of the package"
        raise BadInput(Problem("Demo", f"{truth} is not here", cure))
    if str(SCENES) not in sys.path:
        sys.path.insert(0, str(SCENES))
    return importlib.import_module(NAME), json.loads(truth.read_text(encoding="utf-8"))


def _rows(report: dict[str, Any], truth: dict[str, Any]) -> list[dict[str, Any]]:
    """One row per number: start, fitted, true, error and whether it keeps its limit."""
    rows = []
    for parameter, true in truth["parameters"].items():
        found = report["parameters"][f"{truth['material']}:{parameter}"]
        numbers = [np.atleast_1d(x) for x in (found["initial"], found["value"], true)]
        for i, (start, fitted, exact) in enumerate(zip(*numbers, strict=True)):
            error = float(fitted - exact)
            rows.append({
                "name": parameter + (f".{'rgb'[i]}" if len(numbers[0]) > 1 else ""),
                "start": float(start), "fitted": float(fitted), "true": float(exact),
                "error": error, "permitted": LIMITS[parameter],
                "good": abs(error) <= LIMITS[parameter],
            })  # fmt: skip
    return rows


def _pictures(
    folder: Path, fitted_file: Path, cameras: list[str]
) -> dict[str, dict[str, np.ndarray]]:
    """camera -> photo, start, fit, cycles: (h, w, 3) linear, all of one size."""
    comparison = importlib.import_module("comparison")
    pictures: dict[str, dict[str, np.ndarray]] = {}
    for camera in cameras:
        names = {"photo": "reference", "start": "initial", "fit": "optimised"}
        pictures[camera] = {k: _read(folder / f"{camera}_{v}.exr") for k, v in names.items()}
    height, width = pictures[cameras[0]]["photo"].shape[:2]
    rendered = comparison.render_cameras(
        fitted_file, cameras, (width, height), folder, CYCLES_SAMPLES
    )
    for camera, path in rendered.items():
        pictures[camera]["cycles"] = _read(path)
    return pictures


def _read(path: Path) -> np.ndarray:
    return native.image().read(str(path))[0]


def _misfit(picture: np.ndarray, photo: np.ndarray) -> dict[str, float]:
    difference = picture - photo
    mean = float(photo.mean())
    return {
        "relative_bias": float(difference.mean()) / mean,
        "relative_rmse": float(np.sqrt(np.mean(difference**2))) / mean,
    }


def _contact_sheet(pictures: dict[str, dict[str, np.ndarray]], path: Path) -> None:
    """A row per camera: photo, start, fit, Cycles with the fitted values, absolute error."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    titles = ("photo", "start", "fit", "fitted values in Cycles", "|Cycles - photo|")
    figure = Figure(figsize=(15, 2.05 * len(pictures) + 0.3), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(pictures), len(titles), squeeze=False)
    encode = native.image().srgb_encode
    for axis, title in zip(axes[0], titles, strict=True):
        axis.set_title(title)
    for row, (camera, shown) in zip(axes, pictures.items(), strict=True):
        for axis in row:
            axis.set_xticks([])
            axis.set_yticks([])
        row[0].set_ylabel(camera)
        for axis, key in zip(row, ("photo", "start", "fit", "cycles"), strict=False):
            axis.imshow(np.clip(encode(shown[key]), 0, 1))
        error = np.abs(shown["cycles"] - shown["photo"]).mean(-1)
        drawn = row[-1].imshow(error, cmap="inferno", vmin=0, vmax=0.2)
        figure.colorbar(drawn, ax=row[-1], label="radiance")
    figure.savefig(path, dpi=110)
