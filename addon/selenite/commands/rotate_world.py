# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite rotate-world`: rotation and exposure of a known panorama, by the photos."""

from __future__ import annotations

import argparse
import math

from ..advice.information.world_rotation import RotationSearch, said
from ..fit.settings import FitSettings, with_overrides
from ..problems import BadInput, Problem
from . import arguments
from .capture_arguments import captures_from, stored_captures
from .grouping import grouped
from .scene import open_scene, reading_of
from .terminal import bar, say, say_saved

_SETTINGS = ("height", "spp", "seed", "depth", "threads", "physical_refraction")


def run(args: argparse.Namespace) -> dict[str, object]:
    """Says the angle and the strength and, with --save, writes a copy of the scene at them."""
    problems: list[Problem] = []
    save = arguments.optional_file(args.save, (".blend",), problems)
    settings = FitSettings(height=64, spp=64)
    try:
        settings = with_overrides(settings, {name: getattr(args, name) for name in _SETTINGS})
    except BadInput as error:
        problems += error.problems
    scene, values = open_scene(args.scene, reading_of(args))

    from ..capture.scene_captures import packed_photos

    requests = captures_from(args, stored_captures(args, scene, problems), values, problems)
    arguments.stop_if([*values.problems, *problems])
    values.physical_refraction = settings.physical_refraction
    search = RotationSearch(values, requests, settings, packed_photos())
    with bar("rotating") as shown:
        for step in search.steps():
            shown.update(step.fraction)
    for text in grouped(search.warnings):
        say(f"warning: {text}")
    first, *more = said(search)
    say(first)
    for text in grouped(more):
        say(f"warning: {text}")
    result, strength = search.result, search.strength
    assert result is not None
    report: dict[str, object] = {
        "degrees": math.degrees(result.angle),
        "strength": strength,
        "misfit": result.misfit,
        "other_degrees": None if result.other is None else math.degrees(result.other),
        "tried": {
            "degrees": [math.degrees(item) for item in result.angles],
            "misfit": list(result.misfits),
        },
        "saved": None,
    }
    if save is not None:
        from .. import write_back
        from ..write_back import environments

        say(environments.rotate(scene, values, result.angle, strength))
        say_saved(save, write_back.save_copy(str(save)))
        report["saved"] = str(save)
    return report
