# SPDX-License-Identifier: GPL-3.0-or-later
"""What all commands do with a scene: open, read, choose a camera and a size."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

from .. import native
from ..fit.plan import build_scene
from ..fit.settings import number
from ..fit.unknowns import find_parameter
from ..parameters import Parameter, Values, join_name
from ..problems import BadInput, Problem, choice, listed, refused
from ..scene_read.options import ReadingOptions, set_options
from ..scene_read.values import CameraValues, Owner, SceneValues
from .arguments import input_file, stop_if, unquoted
from .grouping import grouped
from .terminal import say

if TYPE_CHECKING:
    from .._core import Scene
    from ..scene_read.hosts import BpyStruct

#: A pixel while it is rendered and handed on: its mean, half of it and its error, each twice.
_BYTES_OF_PIXEL = 72
#: What a render that the native module refuses is told as, beside its own words.
RENDER = ("Render", "change the size or the samples")


def reading_of(args: argparse.Namespace) -> ReadingOptions:
    """--bake and --approximate."""
    return ReadingOptions(args.bake, args.approximate)


def open_scene(path: str, options: ReadingOptions) -> tuple[BpyStruct, SceneValues]:
    """(bpy scene, its values). options: what the scene need not have on itself. Raises BadInput
    when the file cannot be opened."""
    problems: list[Problem] = []
    file = input_file(path, problems, "give the path of a .blend file")
    stop_if(problems)
    from ..scene_read import blend_file
    from ..scene_read.scene import read_scene
    from . import addon_settings

    addon_settings.make_known()
    scene = blend_file.open_blend(str(file))
    set_options(scene, options)
    values = read_scene(scene, note=say)
    for text in (*blend_file.warnings_of_file(), *blend_file.blocked_drivers()):
        values.warn(text)
    return scene, values


def camera_of(
    values: SceneValues, name: str | None, active: str | None, problems: list[Problem]
) -> CameraValues | None:
    """The named camera, or without a name the `active` one of the scene, or else the only one."""
    cameras = {camera.name: camera for camera in values.cameras}
    if name is None and active is not None:
        name = active
    elif name is None and len(cameras) == 1:
        name = next(iter(cameras))
    if name is not None and name not in cameras:
        name = unquoted(name)
    if name in cameras:
        return cameras[name]
    if name is None:
        if cameras:  # without any camera the scene has a problem of its own
            cause = "the scene has no active one, and --camera names none"
            problems.append(Problem("Camera", cause, f"use one of {listed(cameras)}"))
        return None
    cure = choice(name, cameras)
    reason = values.unusable_cameras.get(name, "it is not in the scene")
    problems.append(Problem(f"Camera '{name}'", reason, cure))
    return None


def active_camera(scene: BpyStruct) -> str | None:  # a bpy scene
    """Name of the camera that Blender renders through; None where none is set."""
    camera = scene.camera  # may be an object of any kind
    return camera.name if camera is not None and camera.type == "CAMERA" else None


def picture_size(
    camera: CameraValues | None, width: int | None, height: int | None, problems: list[Problem]
) -> tuple[int, int]:
    """The given size; a side that is not given follows the scene's aspect: see `picture_frame`."""
    ranges = native.core().setting_ranges()["render"]
    for side, value in (("width", width), ("height", height)):
        low, high = ranges[side]
        if value is not None and not low <= value <= high:
            cure = f"give {number(low)} to {number(high)}"
            problems.append(Problem(f"Argument --{side}", f"it is {value}", cure))
            return 1, 1
    if camera is None:
        return 1, 1
    if width is None and height is None:
        width, height = camera.width, camera.height
    elif height is None:
        assert width is not None  # noqa: S101 - see above
        height = max(1, round(width / camera.aspect))
    elif width is None:
        width = max(1, round(height * camera.aspect))
    most = min(ranges["pixels"][1], native.image().largest_picture, _pixels_in_memory())
    if width * height > most:
        cause = f"{width} x {height} are {width * height} pixels"
        cure = f"give sizes of at most {number(most)} pixels, for which there is room"
        problems.append(Problem("Picture", cause, cure))
    return width, height


def _pixels_in_memory() -> float:
    """Pixels of a render that this computer's memory holds."""
    names = ("SC_PHYS_PAGES", "SC_PAGE_SIZE")
    if not all(name in getattr(os, "sysconf_names", ()) for name in names):
        return math.inf
    return math.prod(map(os.sysconf, names)) // _BYTES_OF_PIXEL


def picture_frame(
    camera: CameraValues, width: int | None, height: int | None
) -> tuple[float, int, int]:
    """`frame` of a native render. Of two given sides it is what Blender renders at this resolution;
    where one follows from the other and is rounded, the picture still shows all that the camera
    takes, as a photo of it brought to that size does."""
    one = (width is None) != (height is None)
    return (camera.aspect if one else 0.0, 0, 0)


def find_constant(
    values: SceneValues, owner_name: str, name: str, problems: list[Problem]
) -> tuple[Owner, Parameter] | None:
    """A parameter that has one value, which can be replaced; a texture cannot."""
    found = find_parameter(values, owner_name, name, problems)
    if found is None:
        return None
    owner, parameter = found
    if parameter.name not in owner.values:
        reason = owner.fixed.get(parameter.name, "its value could not be read")
        cause, _, cure = reason.partition(": ")
        title = f"Parameter '{join_name(owner.name, parameter.name)}'"
        problems.append(Problem(title, cause, cure or "name another parameter"))
        return None
    return found


def native_scene(
    values: SceneValues, changes: Mapping[tuple[str, str], Values], problems: list[Problem]
) -> Scene:
    """Builds the scene with some values replaced. Raises BadInput with `problems` and its own."""
    checked = {}
    for (owner_name, name), numbers in changes.items():
        found = find_constant(values, owner_name, name, problems)
        if found is None:
            continue
        owner, parameter = found
        numbers = parameter.broadcast(numbers)
        complaint = parameter.complaint(numbers)
        if complaint:
            title = f"Parameter '{owner.name}:{name}'"
            problems.append(Problem(title, complaint, "give a value inside"))
        checked[owner.name, name] = numbers
    every = [*values.problems, *problems]
    if every:
        raise BadInput(every)
    scene = build_scene(values)
    for text in grouped(values.warnings):
        say(f"warning: {text}")
    with refused("Scene", "change the values"):
        return scene.with_values(checked) if checked else scene
