# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite lamps`: bright spots of the world's image as suns."""

from __future__ import annotations

import argparse

from ..paths import absolute
from ..problems import BadInput, Problem
from ..report.fitted_scene import at_result
from . import arguments
from .scene import open_scene, reading_of
from .terminal import say, say_saved


def run(args: argparse.Namespace) -> dict[str, object]:
    """Lists the suns and, with --save, writes a copy of the scene that has them."""
    problems: list[Problem] = []
    save = arguments.optional_file(args.save, (".blend",), problems)
    if args.count < 1:
        cause, cure = f"it is {args.count}", "give a number from 1 up"
        problems.append(Problem("Argument --count", cause, cure))
    scene, values = open_scene(args.scene, reading_of(args))
    if args.result is not None:
        try:
            values, _ = at_result(values, absolute(args.result))
        except BadInput as error:
            problems += error.problems
    arguments.stop_if([*values.problems, *problems])

    from .. import write_back
    from ..write_back import suns

    found, rest = suns.proposed(values, args.count)
    for item in found:
        say(suns.text(item))
    report: dict[str, object] = {
        "suns": [vars(item) for item in found],
        "saved": None,
    }
    if save is not None:
        say(suns.add(scene, values, found, rest))
        say_saved(save, write_back.save_copy(str(save)))
        report["saved"] = str(save)
    return report
