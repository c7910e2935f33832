# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that name photos and say how they were taken, and the captures that they make."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..capture.capture_property import CaptureProperty
from ..capture.request import PROPERTIES, CaptureRequest, with_ids
from ..capture.value_kinds import OneOf, Whole
from ..paths import absolute
from ..problems import BadInput, Problem, meant

if TYPE_CHECKING:
    import bpy

    from ..scene_read.values import SceneValues

_OPTIONS = tuple(item for item in PROPERTIES if item.option is not None)
_OF_PHOTOS = tuple(item for item in _OPTIONS if item.option is not None and item.option.of_photo)
_OF_ALL = tuple(item for item in _OPTIONS if item not in _OF_PHOTOS)
_SILHOUETTE = next(item for item in PROPERTIES if item.name == "silhouette")


def add_captures(parser: argparse._ActionsContainer, photo: str) -> None:
    """--photo with its help, and how photos were taken."""
    more = "may be given several times, for one camera too: its photos are CAMERA, CAMERA#2, ..."
    many = {"action": "append", "default": []}
    parser.add_argument("--photo", **many, metavar="CAMERA=FILE", help=f"{more}; {photo}")
    parser.add_argument("--captures", metavar="FILE.json", help="photos and how they were taken")
    for item in _OPTIONS:
        _add(parser, item)


def _add(parser: argparse._ActionsContainer, item: CaptureProperty) -> None:
    option = item.option
    assert option is not None  # noqa: S101 - see `_OPTIONS`
    text = option.help or item.help
    text = f"{text[0].lower()}{text[1:]}{option.more}"
    name, words = item.flag, {"help": text, "metavar": option.metavar}
    if option.of_photo:
        parser.add_argument(name, action="append", default=[], **words)
    elif option.value is not None:
        parser.add_argument(name, action="store_const", const=option.value, help=text)
    elif isinstance(item.kind, OneOf):
        parser.add_argument(name, choices=item.kind.names, **words)
    else:
        parser.add_argument(name, type=item.kind.parsed_as, **words)


def names_photos(args: argparse.Namespace) -> bool:
    """Whether an option names a photo, or says something of one."""
    return bool(args.captures or args.photo or any(getattr(args, x.argument) for x in _OF_PHOTOS))


def given_for_captures(args: argparse.Namespace) -> list[str]:
    """Those of the arguments of `add_captures` that are given."""
    names = ("photo", "captures", *(item.argument for item in _OPTIONS))
    return [name for name in names if getattr(args, name) not in (None, [])]


def take_captures(args: argparse.Namespace, file: str) -> None:
    """Has the captures of a file alone, which says what the options did."""
    args.photo, args.captures = [], file
    for item in _OPTIONS:
        setattr(args, item.argument, [] if item in _OF_PHOTOS else None)


def stored_captures(
    args: argparse.Namespace, scene: bpy.types.Scene, problems: list[Problem]
) -> list[CaptureRequest]:
    """Those of the scene. Adds what is wrong with them, unless others are given."""
    from ..capture.scene_captures import captures_of, misplaced_backgrounds  # needs Blender

    if not args.captures and not args.photo:
        problems += misplaced_backgrounds(scene)
    return captures_of(scene)


def captures_from(
    args: argparse.Namespace,
    stored: Sequence[CaptureRequest],
    values: SceneValues,
    problems: list[Problem],
) -> tuple[CaptureRequest, ...]:
    """--captures, --photo, or else what is stored; options of one photo add to any, by its id. The
    others are those of photos that do not say. Raises BadInput with all of `problems` where the
    file of --captures cannot be read: nothing that follows would make sense."""
    from ..capture.captures_file import read_captures_file  # not for --help, as it needs numpy
    from . import arguments

    if args.captures:
        if args.photo:
            cause, cure = "--photo is given too", "list all photos in the file"
            problems.append(Problem("Argument --captures", cause, cure))
        try:
            stored = read_captures_file(absolute(args.captures))
        except BadInput as error:
            problems += error.problems
            raise BadInput(problems) from error
    cameras = [*(camera.name for camera in values.cameras), *values.unusable_cameras]
    given = [CaptureRequest(*pair) for pair in arguments.files(args.photo, problems, cameras)]
    captures = with_ids(given or stored, (camera.name for camera in values.cameras))
    for item in _OF_PHOTOS:
        files = _by_photo(getattr(args, item.argument), captures, problems)
        captures = tuple(
            replace(capture, **{item.name: files.get(capture.id, getattr(capture, item.name))})
            for capture in captures
        )
    for item in _OF_ALL:
        value = getattr(args, item.argument)
        if value is None:
            continue
        check_range(item, value, problems)
        value = item.kind.moved(value, lambda name: str(absolute(name)))
        captures = tuple(
            replace(capture, **{item.name: value}) if capture.leaves_out(item) else capture
            for capture in captures
        )
    return captures


def check_silhouette(value: int | None, problems: list[Problem]) -> None:
    """Of another command than those of `add_captures`."""
    if value is not None:
        check_range(_SILHOUETTE, value, problems)


def check_range(item: CaptureProperty, value: object, problems: list[Problem]) -> None:
    """What argparse has not checked."""
    limits = item.kind.limits()
    if limits and isinstance(value, (int, float)) and not limits["min"] <= value <= limits["max"]:
        what = "whole number" if isinstance(item.kind, Whole) else "number"
        cure = f"give a {what} from {limits['min']} to {limits['max']}"
        problems.append(Problem(f"Argument {item.flag}", f"it is {value}", cure))


def _by_photo(
    texts: Sequence[str], captures: Sequence[CaptureRequest], problems: list[Problem]
) -> dict[str, str]:
    """Files of --mask or --exclude by the id of a photo."""
    from . import arguments

    found: dict[str, str] = {}
    ids = [item.id for item in captures]
    for name, mask in arguments.files(texts, problems, ids):
        if name in found:
            problems.append(Problem(f"Photo '{name}'", "it has two masks", "keep one"))
        elif name not in ids:
            camera = name.partition("#")[0]
            cause = "a mask is given but no photo"
            near = "" if camera in ids else meant(name, ids)
            cure = f"{near}add --photo {camera}=FILE"
            problems.append(Problem(f"Photo '{name}'", cause, cure))
        found[name] = mask
    return found
