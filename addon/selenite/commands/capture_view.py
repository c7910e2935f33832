# SPDX-License-Identifier: GPL-3.0-or-later
"""One photo of --captures, as a fit would compare with it."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from .. import native
from ..capture.captures_file import read_captures_file
from ..capture.prepared import Capture, read_captures
from ..capture.request import CaptureRequest, with_ids
from ..fit.capture_render import as_reported
from ..fit.checkpoint import RESULT
from ..fit.request import read_run
from ..json_text import read_json
from ..paths import absolute, is_folder
from ..problems import BadInput, Problem, choice
from ..scene_read.values import SceneValues


def capture_view(
    args: argparse.Namespace, values: SceneValues, problems: list[Problem]
) -> Capture | None:
    """--capture of --captures, at --height or the photo's own size. --captures
    may also be the folder of a fit, or its run.json: then gain and alignment are those that the
    fit has found, as they are with --result."""
    for name in ("camera", "width"):
        if getattr(args, name) is not None:
            cause = "the photo of --capture has its own"
            cure = "leave it out" if name == "camera" else "give --height, or neither"
            problems.append(Problem(f"Argument --{name}", cause, cure))
    if args.captures is None:
        cause, cure = "there is no list of photos", "add --captures FILE.json, or a result folder"
        problems.append(Problem("Argument --capture", cause, cure))
        return None
    path = absolute(args.captures)
    path = path / "run.json" if is_folder(path) else path
    try:
        captures = _captures_of(path)
    except BadInput as error:
        problems += error.problems
        return None
    captures = with_ids(captures, (camera.name for camera in values.cameras))
    request = _chosen(args, captures, problems)
    if request is None:
        return None
    from ..capture.scene_captures import packed_photos

    height = args.height if args.height is not None else native.image().largest_picture
    found = read_captures(values, [request], height, problems, [], packed_photos())
    if not found:
        return None
    fitted = path
    if path.name != "run.json" and getattr(args, "result", None):
        fitted = absolute(args.result) / "run.json"
    try:
        return as_reported(found[0], _result_of(fitted))
    except ValueError as error:
        cure = "give the folder of a fit that has ended"
        problems.append(Problem(f"File '{fitted.with_name(RESULT)}'", str(error), cure))
        return None


def _captures_of(path: Path) -> tuple[CaptureRequest, ...]:
    """Of a file of captures, or of a fit's run.json. Raises BadInput."""
    return read_run(path).captures if path.name == "run.json" else read_captures_file(path)


def _result_of(path: Path) -> dict[str, object] | None:
    """What a fit beside its run.json has found. Raises ValueError."""
    result = path.with_name(RESULT)
    if path.name != "run.json" or not result.is_file():
        return None
    found = read_json(result)
    return found if isinstance(found, dict) else None


def _chosen(
    args: argparse.Namespace, captures: Sequence[CaptureRequest], problems: list[Problem]
) -> CaptureRequest | None:
    """The one that --capture names; the only one without it."""
    ids = [item.id for item in captures]
    if args.capture is None and len(captures) == 1:
        return captures[0]
    cure = choice(args.capture or "", ids)
    if args.capture is None:
        problems.append(Problem("Argument --capture", "which photo is not said", cure))
        return None
    if args.capture not in ids:
        problems.append(Problem(f"Photo '{args.capture}'", "it is not in the list", cure))
        return None
    return captures[ids.index(args.capture)]
