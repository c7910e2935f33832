# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments about the image of the world as an unknown."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from ..paths import absolute
from ..problems import Problem
from .render_arguments import KEPT, add_reading

if TYPE_CHECKING:
    from ..fit.request import UnknownRequest
    from ..scene_read.values import SceneValues

#: For commands without these arguments.
NO_ENVIRONMENT = {
    "environment": None, "environment_size": None, "environment_projection": None,
}  # fmt: skip
_NAME = ("World", "environment")


def add_environment(parser: argparse._ActionsContainer) -> None:
    """The arguments of `selenite fit`."""
    add = parser.add_argument
    size = "texels of World:environment, 8 to 2048; default: 512, or those of a small image"
    add("--environment-size", type=int, metavar="N", help=size)
    start = "a panorama or a photo of a mirror ball at which World:environment starts"
    add("--environment", metavar="FILE", help=start)
    projection = "of that file; default: equirect. A mirror ball is seen along +Y"
    add("--environment-projection", metavar="equirect|mirror_ball", help=projection)


def add_lamps(parser: argparse.ArgumentParser) -> None:
    """The arguments of `selenite lamps`."""
    parser.add_argument("scene", metavar="SCENE.blend")
    add_reading(parser)
    add = parser.add_argument_group("which image, and how many suns").add_argument
    count = "suns at most, the strongest first; default: 4"
    add("--count", type=int, default=4, metavar="N", help=count)
    result = "folder of a fit: the image is the one that it has found"
    add("--result", metavar="DIR", help=result)
    saved = f"saves a copy with the suns and the rest of the image, else they are listed{KEPT}"
    parser.add_argument_group("results").add_argument("--save", metavar="OUT.blend", help=saved)


def with_environment(
    args: argparse.Namespace,
    values: SceneValues,
    found: dict[tuple[str, str], UnknownRequest],
    problems: list[Problem],
) -> dict[tuple[str, str], UnknownRequest]:
    """The requests with what the arguments say of the world's image."""
    given = {
        "size": args.environment_size,
        "grid": str(absolute(args.environment)) if args.environment is not None else None,
        "projection": args.environment_projection,
    }
    given = {name: value for name, value in given.items() if value is not None}
    if not given:
        return found
    world = values.owners.get(_NAME[0])
    names = {_NAME, (world.datablock, _NAME[1])} if world is not None else {_NAME}
    key = next((item for item in found if item in names), None)
    if key is None:
        cause, cure = "it is not fitted", "add --fit World:environment"
        problems.append(Problem("Parameter 'World:environment'", cause, cure))
        return found
    request = found[key]
    if "grid" in given and request.grid.isdecimal() and "size" not in given:
        given["size"] = int(request.grid) if len(request.grid) < 10 else 10**9
    return found | {key: replace(request, **given)}
