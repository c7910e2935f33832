# SPDX-License-Identifier: GPL-3.0-or-later
"""What all commands do with a scene: open, read, choose a camera and a size."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..fit_run.plan import build_scene
from ..fit_run.unknowns import find_parameter
from ..parameters import Parameter, Values, join_name
from ..problems import BadInput, Problem, listed
from ..scene_read.values import CameraValues, Owner, SceneValues
from .arguments import unquoted
from .terminal import say


def open_scene(path: str) -> tuple[Any, SceneValues]:
    """(bpy scene, its values). Raises BadInput when the file cannot be opened."""
    file = Path(path).expanduser()
    if not file.is_file():
        raise BadInput(
            Problem(f"File '{path}'", "it does not exist", "give the path of a .blend file")
        )
    try:
        from ..scene_read import scene as scene_read
    except ImportError as error:
        cure = "install bpy, or use blender --command selenite"
        raise BadInput(Problem("Blender", f"bpy does not load ({error})", cure)) from error
    scene = scene_read.open_blend(str(file.resolve()))
    return scene, scene_read.read_scene(scene)


def camera_of(
    values: SceneValues, name: str | None, problems: list[Problem]
) -> CameraValues | None:
    """The named camera, or the only one."""
    cameras = {camera.name: camera for camera in values.cameras}
    if name is None and len(cameras) == 1:
        return next(iter(cameras.values()))
    if name is not None and name not in cameras:
        name = unquoted(name)
    if name in cameras:
        return cameras[name]
    cure = f"use one of {listed(cameras)}"
    if name is None:
        if cameras:  # without any camera the scene has a problem of its own
            problems.append(Problem("Camera", "which one is not said", cure))
        return None
    reason = values.unusable_cameras.get(name, "it is not in the scene")
    problems.append(Problem(f"Camera '{name}'", reason, cure))
    return None


def picture_size(
    camera: CameraValues | None, width: int | None, height: int | None, problems: list[Problem]
) -> tuple[int, int]:
    """The given size; a side that is not given follows the scene's aspect: see `picture_frame`."""
    for side, value in (("width", width), ("height", height)):
        if value is not None and not 1 <= value <= 65536:
            problems.append(Problem(f"Argument --{side}", f"it is {value}", "give 1 to 65536"))
    if camera is None:
        return 1, 1
    if height is None:
        if width is None:
            return camera.width, camera.height
        return width, max(1, round(width / camera.aspect))
    if width is None:
        return max(1, round(height * camera.aspect)), height
    return width, height


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
) -> Any:  # noqa: ANN401 - a native Scene has no Python type
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
    for text in values.warnings:
        say(f"warning: {text}")
    return scene.with_values(checked) if checked else scene
