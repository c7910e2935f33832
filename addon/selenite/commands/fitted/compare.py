# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite compare`: what a fit has found, beside photos that it has not seen."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ... import native
from ...atomic_files import write_json
from ...capture.prepared import read_captures
from ...capture.request import CaptureRequest, with_ids
from ...fit.capture_render import as_reported
from ...fit.checkpoint import RESULT
from ...fit.request import read_run
from ...fit.settings import with_overrides
from ...fit.unknowns import fitted_owners
from ...json_text import read_json
from ...paths import absolute
from ...problems import BadInput, Problem, listed
from ...report import hold_out
from ...report.fitted_scene import at_result
from ...report.results import SHEET
from .. import arguments
from ..capture_arguments import captures_from
from ..scene import native_scene, open_scene
from ..terminal import bar, say, table

if TYPE_CHECKING:
    from ...json_text import JsonObject

_SETTINGS = ("height", "seed", "threads")
#: In --out, and where it goes without: in the folder of the fit.
REPORT, FOLDER = "compare.json", "compared"


def run(args: argparse.Namespace) -> JsonObject:
    """Renders each photo at the fitted values; writes a report and a contact sheet."""
    problems: list[Problem] = []
    folder = absolute(args.result)
    out = arguments.output_folder(args.out or str(folder / FOLDER), problems)
    request = read_run(folder / "run.json")
    settings = request.settings
    try:
        settings = with_overrides(settings, {name: getattr(args, name) for name in _SETTINGS})
    except BadInput as error:
        problems += error.problems
    scene, values = open_scene(args.scene or request.scene, request.reading)
    values.physical_refraction = settings.physical_refraction
    values, constants = at_result(values, folder)
    cameras = [camera.name for camera in values.cameras]
    fitted = with_ids(request.captures, cameras)
    asked = with_ids(captures_from(args, _hold_out(fitted), values, problems), cameras)

    from ...capture.scene_captures import packed_photos

    owners = fitted_owners(values, request.unknowns)
    captures = read_captures(
        values, asked, settings.height, problems, values.warnings, packed_photos(), owners
    )
    spp = settings.picture_spp if args.spp is None else args.spp
    low, high = native.core().setting_ranges()["render"]["spp"]
    if not max(low, 2) <= spp <= high:
        cause = f"it is {spp}"
        problems.append(Problem("Argument --spp", cause, f"give {max(low, 2)} to {high:g}"))
    native_one = native_scene(values.without_shut(constants), constants, problems)
    seen = hold_out.fitted_among(captures, [item for item in fitted if not item.hold_out])
    try:
        result = read_json(folder / RESULT)
        placed = [as_reported(item, result) if item.id in seen else item for item in captures]
    except ValueError as error:
        cure = "give the folder of a fit that has ended"
        raise BadInput(Problem(f"File '{folder / RESULT}'", str(error), cure)) from error
    with bar("comparing") as shown:
        rows = hold_out.compare_all(
            native_one,
            placed,
            replace(settings, seed=settings.seed + 1),
            spp,
            lambda text, fraction: shown.update(fraction, note=text),
        )
    found = hold_out.report(rows, seen)
    for text in _lines(found, seen):
        say(text)
    out.mkdir(parents=True, exist_ok=True)
    hold_out.write_sheet(rows, out / SHEET)
    write_json(out / REPORT, found)
    say(f"wrote {out / REPORT} and {out / SHEET}")
    return found | {"folder": str(out)}


def _hold_out(captures: Sequence[CaptureRequest]) -> tuple[CaptureRequest, ...]:
    """What is compared unless photos are named: what the fit held out, else what it has seen."""
    return tuple(item for item in captures if item.hold_out) or tuple(captures)


def _lines(found: JsonObject, seen: Sequence[str]) -> list[str]:
    """The report for people."""
    rows = [
        [name, hold_out.percent(row), hold_out.percent(row["with_own_gain"]),
         ", ".join(f"{gain:.3g}" for gain in dict.fromkeys(row["own_gain"]))]
        for name, row in found["captures"].items()
    ]  # fmt: skip
    table(["photo", "error", "with its own gain", "that gain"], rows)
    own = hold_out.percent(found["with_own_gain"])
    lines = [f"all photos: {hold_out.percent(found)}, with gains of their own {own}"]
    if seen:
        lines.append(f"The fit has seen {listed(seen)}: that error says nothing of other photos")
    return lines
