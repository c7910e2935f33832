# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that name photos and say how they were taken, and the captures that they make."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..capture.request import AUTO_RESPONSE, GAINS, MOST_ERODED, CaptureRequest, with_ids
from ..paths import absolute
from ..problems import BadInput, Problem, meant

if TYPE_CHECKING:
    import bpy

    from ..scene_read.values import SceneValues


def add_captures(parser: argparse._ActionsContainer, photo: str) -> None:
    """--photo with its help, and how photos were taken."""
    many = {"action": "append", "default": []}
    more = "may be given several times, for one camera too: its photos are CAMERA, CAMERA#2, ..."
    parser.add_argument("--photo", **many, metavar="CAMERA=FILE", help=f"{more}; {photo}")
    mask = "black pixels of it do not count; PHOTO: the camera's name, or CAMERA#2 for its second"
    parser.add_argument("--mask", **many, metavar="PHOTO=FILE", help=mask)
    exclude = "white pixels of it do not count"
    parser.add_argument("--exclude", **many, metavar="PHOTO=FILE", help=exclude)
    silhouette = "only what the camera sees of the fitted objects counts, N pixels off its rim"
    parser.add_argument("--silhouette", type=int, metavar="N", help=silhouette)
    background = "border (what joins it in one colour) or R,G,B; with a tolerance: border:0.1"
    parser.add_argument("--background", metavar="WHAT", help=f"it does not count: {background}")
    response = "how code values became of light: auto, srgb, linear, gamma:2.2, or a table"
    parser.add_argument("--response", metavar="NAME|FILE.csv", help=response)
    undistorted = "the photos are free of the distortion that an import has kept with their cameras"
    parser.add_argument("--undistorted", action="store_true", help=undistorted)
    parser.add_argument("--captures", metavar="FILE.json", help="photos and how they were taken")
    gain = "factor on the render that the fit finds for each photo; default: none"
    parser.add_argument("--gain", choices=GAINS, help=gain)
    parser.add_argument(
        "--align",
        action="store_true",
        default=None,
        help="find a shift and roll of each photo within 4 pixels",
    )


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
    """--captures, --photo, or else what is stored; --mask and --exclude add to any, by the id of a
    photo. The others are those of photos that do not say. Raises BadInput with all of `problems`
    where the file of --captures cannot be read: nothing that follows would make sense."""
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
    if args.undistorted:
        captures = tuple(
            item if item.distortion else replace(item, distortion=False) for item in captures
        )
    masks = _masks(args.mask, captures, problems)
    excluded = _masks(args.exclude, captures, problems)
    if args.silhouette is not None and not 0 <= args.silhouette <= MOST_ERODED:
        cure = f"give a number of pixels from 0 to {MOST_ERODED}"
        problems.append(Problem("Argument --silhouette", f"it is {args.silhouette}", cure))
    response = args.response or AUTO_RESPONSE
    if CaptureRequest("", "", response=response).response_file:
        response = str(absolute(response))
    return tuple(
        replace(
            item,
            mask=masks.get(item.id, item.mask),
            exclude=excluded.get(item.id, item.exclude),
            gain=item.gain or args.gain or "",
            align=item.align if item.align is not None else args.align,
            silhouette=item.silhouette if item.silhouette is not None else args.silhouette,
            background=item.background or args.background or "",
            response=response if item.response == AUTO_RESPONSE else item.response,
        )
        for item in captures
    )


def _masks(
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
