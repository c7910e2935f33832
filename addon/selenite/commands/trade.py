# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite trade`: what more time buys, measured on the scene itself."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from ..advice.trade import report
from ..advice.trade.expected import Estimate
from ..advice.trade.measure import Trade
from ..advice.trade.start import estimate_of, trade_of
from ..fit.plan import FitPlan
from ..fit.request import RunRequest
from ..fit.settings import FitSettings, with_overrides
from ..paths import absolute
from ..problems import BadInput, Problem
from . import arguments
from .capture_arguments import captures_from, stored_captures
from .fit import unknowns_of
from .grouping import grouped
from .scene import open_scene, reading_of
from .terminal import bar, say, table

if TYPE_CHECKING:
    from ..json_text import JsonObject

_SETTINGS = ("loss", "optimiser", "seed", "threads", "physical_refraction")


def run(args: argparse.Namespace) -> JsonObject:
    """Measures within --budget and writes the table and the plot into --out; with --expected
    prints what the presets should take, and writes nothing."""
    problems: list[Problem] = []
    if args.out is not None:
        out = arguments.output_folder(args.out, problems)
    elif not args.expected:
        cause, cure = "there is no folder for the table", "add --out DIR, or --expected"
        problems.append(Problem("Argument --out", cause, cure))
    if not (math.isfinite(args.budget) and args.budget > 0):
        cause, cure = f"it is {args.budget:g}", "give seconds above 0"
        problems.append(Problem("Argument --budget", cause, cure))
    settings = FitSettings()
    try:
        settings = with_overrides(settings, {name: getattr(args, name) for name in _SETTINGS})
    except BadInput as error:
        problems += error.problems
    scene, values = open_scene(args.scene, reading_of(args))

    from ..capture.scene_captures import packed_photos

    request = RunRequest(
        scene=str(absolute(args.scene)),
        unknowns=unknowns_of(args, RunRequest(args.scene), values, (), problems),
        captures=captures_from(args, stored_captures(args, scene, problems), values, problems),
        settings=settings,
    )
    try:
        if args.expected:
            estimate = estimate_of(values, request, packed_photos(), without_photos=True)
        else:
            trade = trade_of(values, request, packed_photos(), args.budget)
    except BadInput as error:
        problems += error.problems
    arguments.stop_if(problems)
    if args.expected:
        return _expect(estimate)
    plan = trade.plan
    for text in grouped(plan.warnings):
        say(f"warning: {text}")
    _measure(trade)
    content = report.report(trade)
    _show(content, plan)
    try:
        files = report.write(content, out)
    except OSError as error:
        cause = f"Folder '{out}': the table cannot be written ({error})"
        return content | {"folder": None, "error": f"{cause}; make room or choose another --out"}
    if why := report.why_no_plot(content):
        say(f"warning: {why}")
    say(f"wrote {', '.join(path for path in files.values() if path)}")
    return content | {"folder": str(out), "files": files}


def _expect(estimate: Estimate) -> JsonObject:
    """Seconds and errors of the presets, line by line."""
    for text in grouped(estimate.warnings):
        say(f"warning: {text}")
    with bar("estimating") as shown:
        for step in estimate.steps():
            shown.update(step.fraction, note=step.text)
    for line in estimate.lines():
        say(line)
    presets = {name: item.as_json() for name, item in estimate.presets.items()}
    return {"error_is": report.ERROR_IS, "presets": presets, "remark": estimate.remark or None}


def _measure(trade: Trade) -> None:
    """Runs to the end of the budget; Ctrl+C keeps what has been measured."""
    try:
        with bar("measuring") as shown:
            for step in trade.steps():
                shown.update(step.fraction, trade.budget - trade.seconds, step.text)
    except KeyboardInterrupt:
        say("stopping; what has been measured is kept")
    finally:
        trade.cancel()


def _show(content: JsonObject, plan: FitPlan) -> None:
    """The table, fastest first; `front` marks what nothing else beats in time and error."""
    rows = sorted(content["settings"], key=lambda row: row["seconds"] or math.inf)
    table(
        ("settings", "runs", "seconds", "expected", "error", "front"),
        [
            (
                row["preset"].capitalize() if row["preset"] else row["name"],
                str(row["runs"]),
                f"{row['seconds']:.1f}" if row["runs"] else "-",
                f"{row['expected_seconds']:.1f}",
                f"{row['error']:.4f}" if row["runs"] else "-",
                "front" if row["on_front"] else "",
            )
            for row in rows
        ],
    )
    for row in rows:
        if row["failure"]:
            say(f"warning: '{row['name']}' came to no end: {row['failure']}")
    left_out = sum(not row["runs"] and not row["failure"] for row in rows)
    if left_out:
        say(f"{left_out} settings do not fit into {content['budget']:g} s; raise --budget")
    for item in plan.unknowns:
        known = content["parameters"][item.name]
        true, start = (", ".join(f"{x:.4g}" for x in known[key]) for key in ("true", "start"))
        say(f"{item.name}: photos at {true}; fits start at {start}")
