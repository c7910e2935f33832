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
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from . import native
from .commands.arguments import output_folder, stop_if
from .commands.terminal import say, table
from .problems import BadInput, Problem

if TYPE_CHECKING:
    from .json_text import JsonObject

NAME = "jade_pendant"
#: Largest permitted error of each parameter: what the demo promises.
LIMITS = {"base_color": 0.03, "roughness": 0.05, "transmission": 0.05, "ior": 0.05}
#: Radiance at which the picture of the error is brightest.
LARGEST_ERROR = 0.2


def scenes() -> Path:
    """Folder of the demo scene: inside an installed package, `scenes` in a checkout."""
    here = Path(__file__).resolve()
    installed = here.parent / "demo_scene"
    return installed if installed.is_dir() else here.parents[2] / "scenes"


def run(args: argparse.Namespace) -> JsonObject:
    """Fits the demo scene, writes everything to --out, returns the report."""
    from .commands import fit

    problems: list[Problem] = []
    out = output_folder(args.out, problems)
    stop_if(problems)
    scene, truth = _scene()
    out.mkdir(parents=True, exist_ok=True)
    start_file, fitted_file = out / "start.blend", out / "fitted.blend"
    say("building the scene with its dark opaque start")
    scene.EXAMPLE.save_start(start_file)
    photos = [f"--photo={c}={scene.PHOTOS / c}.png" for c in truth["cameras"]]
    command = ["fit", str(start_file), *photos]
    command += [f"--fit={truth['material']}:{','.join(truth['parameters'])}"]
    command += [f"--out={out}", f"--save={fitted_file}", "--check-in-cycles"]
    report = fit.run(args.parser.parse_args(command))
    if "error" in report:
        return {"good": False, "fit": report, "error": report["error"]}

    rows = _rows(report, truth)
    sheet = out / "contact_sheet.png"
    _contact_sheet(Path(report["folder"]), truth["cameras"], sheet)
    table(
        ("parameter", "start", "fitted", "true", "error", "permitted", ""),
        [
            (r["name"], *(f"{r[k]:.4f}" for k in ("start", "fitted", "true", "error", "permitted")),
             "good" if r["good"] else "MISSED")
            for r in rows
        ],
    )  # fmt: skip
    good = all(row["good"] for row in rows)
    say(f"{'all values within limits' if good else 'some values miss their limits'}; "
        f"{report['seconds']:.0f} s for the fit; {sheet}")  # fmt: skip
    return {
        "good": good,
        "seconds": report["seconds"],
        "parameters": rows,
        "cycles_against_photo": {
            camera: row["cycles_against_photo"]
            for camera, row in report["cycles"]["photos"].items()
        },
        "contact_sheet": str(sheet),
        "fitted": str(fitted_file),
        "fit": report,
    }


def _scene() -> tuple[ModuleType, JsonObject]:
    folder = scenes()
    truth = folder / NAME / "truth.json"
    if not truth.is_file():
        cure = "install the package again: a part of it is missing"
        raise BadInput(Problem("Demo", f"{truth} is not here", cure))
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
    return importlib.import_module(NAME), json.loads(truth.read_text(encoding="utf-8"))


def _rows(report: JsonObject, truth: JsonObject) -> list[JsonObject]:
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


def _contact_sheet(folder: Path, cameras: list[str], path: Path) -> None:
    """A row per camera: photo, start, fit, Cycles with the fitted values, its error."""
    from .report.pictures import sheet

    names = {"photo": "reference", "start": "initial", "fit": "optimised"}
    names["fitted values in Cycles"] = "cycles"
    rows: dict[str, dict[str, np.ndarray]] = {}
    for camera in cameras:
        rows[camera] = {title: _read(folder / f"{camera}_{n}.exr") for title, n in names.items()}
        error = np.abs(_read(folder / f"{camera}_cycles_minus_photo.exr"))
        rows[camera]["|Cycles - photo|"] = error.mean(axis=-1)
    sheet.write(path, rows, LARGEST_ERROR)


def _read(path: Path) -> np.ndarray:
    pixels: np.ndarray = native.image().read(str(path))[0]
    return pixels
