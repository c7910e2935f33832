# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite compare`: what a fit has found, beside photos that it has not seen."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ... import native
from ...atomic_files import write_json
from ...capture.prepared import read_captures
from ...capture.request import CaptureRequest, with_ids
from ...fit.request import read_run
from ...fit.settings import with_overrides
from ...fit.unknowns import fitted_owners
from ...paths import absolute
from ...problems import BadInput, Problem, listed
from ...report import hold_out
from ...report.fitted_scene import at_result
from ...report.result_file import stored_result
from ...report.results import SHEET
from .. import arguments
from ..capture_arguments import captures_from
from ..scene import native_scene, open_scene
from ..terminal import bar, say, table

_SETTINGS = ("height", "seed", "threads")
#: In --out, and where it goes without: in the folder of the fit.
REPORT, FOLDER = "compare.json", "compared"


def run(args: argparse.Namespace) -> dict[str, object]:
    """`compared`, for --json."""
    found, out = compared(args)
    return found.as_json() | {"folder": str(out)}


def compared(
    args: argparse.Namespace, wants_more: Callable[[hold_out.Comparison, int], bool] | None = None
) -> tuple[hold_out.Comparison, Path]:
    """Renders photos at the fitted values; writes a report and a contact sheet into a folder.
    wants_more: whether twice as many samples as those are to be taken."""
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
    stored = stored_result(folder)
    placed = [stored.as_found(item) if item.id in seen else item for item in captures]
    settings = replace(settings, seed=settings.seed + 1)
    rows: list[hold_out.Compared] = []
    while True:
        with bar("comparing") as shown:
            rows = hold_out.compare_all(
                native_one,
                placed,
                settings,
                spp,
                lambda text, fraction: shown.update(fraction, note=text),
                rows,
            )
        found = hold_out.Comparison(rows, seen)
        if wants_more is None or not wants_more(found, spp):
            break
        spp *= 2
    for text in _lines(found):
        say(text)
    out.mkdir(parents=True, exist_ok=True)
    hold_out.write_sheet(rows, out / SHEET)
    write_json(out / REPORT, found.as_json())
    say(f"wrote {out / REPORT} and {out / SHEET}")
    return found, out


def _hold_out(captures: Sequence[CaptureRequest]) -> tuple[CaptureRequest, ...]:
    """What is compared unless photos are named: what the fit held out, else what it has seen."""
    return tuple(item for item in captures if item.hold_out) or tuple(captures)


def _lines(found: hold_out.Comparison) -> list[str]:
    """The report for people."""
    rows = [
        [row.capture.id, row.error.percent(), row.own.percent(),
         ", ".join(f"{gain:.3g}" for gain in dict.fromkeys(row.own_gain))]
        for row in found.rows
    ]  # fmt: skip
    table(["photo", "error", "with its own gain", "that gain"], rows)
    own = found.own.percent()
    lines = [f"all photos: {found.error.percent()}, with gains of their own {own}"]
    if found.fitted:
        lines.append(
            f"The fit has seen {listed(found.fitted)}: that error says nothing of other photos"
        )
    return lines
