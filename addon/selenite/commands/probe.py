# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite probe`: the BSDF, row by row."""

from __future__ import annotations

import argparse
import csv
import time
from typing import TextIO

import numpy as np

from .. import native
from ..atomic_files import partial_name, take_place
from ..problems import BadInput, Problem
from . import arguments
from .probe_table import RESULTS, SLOPE, Layout, Part, TableReader
from .terminal import say

VALUES = RESULTS[:3]


def run(args: argparse.Namespace) -> dict[str, object]:
    """Evaluates each row of FILE.csv and writes --out, or nothing if any row is wrong."""
    started = time.perf_counter()
    problems: list[Problem] = []
    source = arguments.input_file(args.file, problems, "give a CSV file")
    out = arguments.output_file(args.out, (".csv",), problems)
    if out == source:
        cause = "it is the table that is read"
        problems.append(Problem(f"File '{args.out}'", cause, "give another name to --out"))
    arguments.stop_if(problems)
    partial = partial_name(out)
    with source.open(encoding="utf-8-sig", newline="") as file:
        reader = TableReader(source, file)
        try:
            with partial.open("w", encoding="utf-8", newline="") as to:
                layout, rows = _evaluate(reader, to, args.derivatives, args.precision)
            if layout is None or reader.problems:
                raise BadInput(reader.problems)
            take_place(partial, out)
        finally:
            partial.unlink(missing_ok=True)
    seconds = time.perf_counter() - started
    say(f"wrote {out}: {rows} rows of the Principled BSDF {layout.version} in {seconds:.1f} s")
    return {
        "out": str(out),
        "version": layout.version,
        "rows": rows,
        "columns": _header(layout, args.derivatives),
        "derivatives": args.derivatives,
        "precision": args.precision,
        "seconds": seconds,
    }


def _header(layout: Layout, derivatives: bool) -> list[str]:
    kept = [layout.header[place] for place in layout.kept]
    slopes = [f"{SLOPE}{channel}/d_{name}" for channel in "rgb" for name in layout.parameters]
    return [*kept, *VALUES, *(slopes if derivatives else ())]


def _evaluate(
    reader: TableReader, to: TextIO, derivatives: bool, precision: str
) -> tuple[Layout | None, int]:
    """Writes the parts as they are read; their layout, and how many rows there were."""
    writer = csv.writer(to, lineterminator="\n")
    layout, rows = None, 0
    for layout, part in reader.parts():
        if not rows:
            writer.writerow(_header(layout, derivatives))
        rows += len(part.cells)
        results = _results(layout, part, derivatives, precision)
        writer.writerows(
            [*(row[place] for place in layout.kept), *numbers]
            for row, numbers in zip(part.cells, results, strict=True)
        )
    return layout, rows


def _results(layout: Layout, part: Part, derivatives: bool, precision: str) -> list[list[float]]:
    core = native.core()
    given = (layout.version, layout.names, part.numbers, part.multi_ggx)
    results = core.probe(*given, precision=precision)
    if derivatives:
        slopes = core.probe_slopes(*given, precision=precision)
        results = np.concatenate([results, slopes.reshape(len(results), -1)], axis=1)
    rows: list[list[float]] = results.tolist()
    return rows
