# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos without their lens's distortion, as files: what Blender shows behind its own cameras."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from .. import native
from ..capture import distortion
from ..capture.in_parallel import in_parallel
from ..capture.photo_files import header, unreadable
from ..capture.window import PhotoWindow, Projection
from ..paths import file_stems, is_there
from ..problems import BadInput, Problem
from ..scene_read.lens import LensDistortion
from .plan import ImportPlan, PlannedCamera
from .reconstruction import Intrinsics


def write_photos(
    plan: ImportPlan, folder: Path, note: Callable[[str, float], None] = lambda *_: None
) -> ImportPlan:
    """The plan with an undistorted photo, and a mask of what it shows, for each that a lens
    distorts: PNG of 16 bits with the sRGB curve, or OpenEXR where the photo has floats.

    folder: a new one. Colours go through linear light, as in a fit. Raises BadInput; then the
    folder may hold some files.
    """
    distorted = [item for item in plan.cameras if item.capture and item.intrinsics.distorted]
    if not distorted:
        return plan
    if is_there(folder):
        cause, cure = "it exists", "remove it, or save under another name"
        raise BadInput(Problem(f"Folder '{folder}'", cause, cure))
    folder.mkdir()
    stems = file_stems(item.name for item in distorted)
    count = 0

    def begin(item: PlannedCamera) -> PlannedCamera | list[Problem]:
        nonlocal count
        count += 1
        problems: list[Problem] = []
        try:
            found = _written(item, folder, stems[item.name], problems)
        except (OSError, ValueError, MemoryError) as error:
            problems.append(unreadable(f"Photo of camera '{item.name}'", error))
        return problems or found

    def go_on() -> None:
        text = f"undistorting photo {max(count, 1)} of {len(distorted)}"
        note(text, 0.5 + 0.3 * count / len(distorted))

    # A pixel of an undistorted photo takes some 50 bytes, of one that is read 6.
    sizes = [4 * item.intrinsics.width * item.intrinsics.height for item in distorted]
    made = in_parallel([partial(begin, item) for item in distorted], sizes, go_on)
    if problems := [one for item in made if isinstance(item, list) for one in item]:
        raise BadInput(problems)
    done = {item.name: item for item in made if isinstance(item, PlannedCamera)}
    cameras = tuple(done.get(item.name, item) for item in plan.cameras)
    return replace(plan, cameras=cameras)


@contextmanager
def taken_back(folder: Path) -> Iterator[None]:
    """Whatever fails inside, a folder that was not there before goes away again."""
    existed = is_there(folder)
    try:
        yield
    except BaseException:
        if not existed:  # else it is the user's
            shutil.rmtree(folder, ignore_errors=True)
        raise


def _written(
    camera: PlannedCamera, folder: Path, stem: str, problems: list[Problem]
) -> PlannedCamera:
    capture = camera.capture
    assert capture is not None  # noqa: S101 - see `write_photos`
    info = header(f"Photo '{capture.photo}'", capture.photo, problems, {}, as_linear=True)
    if info is None:
        return camera
    width, height = int(info["width"]), int(info["height"])
    corners = corners_of(camera.intrinsics, (width, height))
    image = native.image()
    pixels, _, inside, _, _ = image.read_at_size(
        capture.photo,
        width,
        height,
        masks=[(capture.mask, "black")] if capture.mask else [],
        corners=corners,
    )
    photo = folder / f"{stem}.{'exr' if info['float'] else 'png'}"
    mask = folder / f"{stem}_mask.png"
    if info["float"]:
        image.write_exr(str(photo), pixels)
    else:
        image.write_png(str(photo), pixels, 16)
    image.write_png(str(mask), (inside >= 1).astype(np.float32))
    lens = camera.intrinsics.lens
    plain = replace(camera.intrinsics, lens=LensDistortion(lens.fx, lens.fy, lens.cx, lens.cy))
    capture = replace(capture, photo=str(photo), mask=str(mask), distortion=None)
    return replace(camera, intrinsics=plain, capture=capture)


def corners_of(found: Intrinsics, file_size: tuple[int, int]) -> np.ndarray:
    """(height + 1, width + 1, 2): where the corners of the undistorted photo's pixels lie in the
    file of (width, height) pixels; NaN for nowhere."""
    lens = found.lens
    whole = (found.width, found.height)
    window = PhotoWindow(whole, (0, 0, *whole), found.width / found.height)
    pinhole = Projection((lens.fx, lens.fy), (lens.cx, lens.cy))
    return distortion.corners(lens, pinhole, window, file_size, *file_size)
