# SPDX-License-Identifier: GPL-3.0-or-later
"""Which photo belongs to which camera. The photos themselves are read natively, by path."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import bpy

from ..messages import thing
from ..problems import Problem
from ..scene_read import hosts
from ..scene_read.camera import named_cameras
from .panel_rows import values_of_row
from .request import CaptureRequest, with_ids
from .value_kinds import PACKED

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

#: Differences in placement that nobody sees, and of shapes that are the same but for rounding.
_STILL, _SAME_SHAPE = 1e-4, 0.01
#: Formats of files that hold light as it is.
_LINEAR_FILES = frozenset({"OPEN_EXR", "OPEN_EXR_MULTILAYER", "HDR"})


def captures_of(scene: bpy.types.Scene) -> list[CaptureRequest]:
    """The scene's captures, or else a background image of each camera."""
    settings = getattr(scene, "selenite", None)
    rows = [row for row in settings.captures if row.enabled] if settings is not None else []
    names = {item: name for name, item in named_cameras(scene).items()}
    if rows:
        return [_of_row(row, names) for row in rows]
    found = []
    for camera, name in names.items():
        background = photo_of(camera)
        if background is not None:
            found.append(CaptureRequest(name, photo_name(background.image), ""))
    return found


def photo_of(camera: bpy.types.Object) -> BpyStruct | None:
    """The first background image that the camera shows, or else the first that it has."""
    data: BpyStruct = camera.data
    images = [item for item in data.background_images if item.source == "IMAGE" and item.image]
    return next((item for item in images if item.show_background_image), next(iter(images), None))


def misplaced_backgrounds(scene: bpy.types.Scene) -> list[Problem]:
    """Of the background images that `captures_of` takes for photos, those that their cameras show
    otherwise than as the file is. The rows of the panel hold files alone."""
    settings = getattr(scene, "selenite", None)
    if settings is not None and any(row.enabled for row in settings.captures):
        return []
    found = []
    for camera, name in {item: name for name, item in named_cameras(scene).items()}.items():
        background = photo_of(camera)
        if background is not None and (how := _how_shown(background, camera, scene)):
            cause = f"its background image '{background.image.name}' is {how} in the camera"
            cure = (
                "reset that in the camera's Background Images and change the file instead, or name "
                "the photo as a capture"
            )
            found.append(Problem(thing("Camera", name), cause, cure))
    return found


def _how_shown(
    background: bpy.types.CameraBackgroundImage, camera: bpy.types.Object, scene: bpy.types.Scene
) -> str:
    """What of the placement or colour is not as the file is; empty if all is."""
    image = background.image
    width, height = image.size
    known = not width * height or _has_space_of_file(image)
    settings = scene.render
    wide = settings.resolution_x * settings.pixel_aspect_x
    high = settings.resolution_y * settings.pixel_aspect_y
    fits = not width * height or abs(width * high / (height * wide) - 1) < _SAME_SHAPE
    found = {
        "flipped": background.use_flip_x or background.use_flip_y,
        "turned": abs(background.rotation) > _STILL,
        "scaled": abs(background.scale - 1) > _STILL,
        "moved": max(abs(background.offset[0]), abs(background.offset[1])) > _STILL,
        "cropped or stretched": background.frame_method != "FIT" and not fits,
        f"shown in the colour space {image.colorspace_settings.name}": not known,
        "one of several": image.source in {"SEQUENCE", "MOVIE", "TILED"},
        "changed and not saved": image.is_dirty,
    }
    return " and ".join(what for what, is_so in found.items() if is_so)


def _has_space_of_file(image: bpy.types.Image) -> bool:
    """Whether it is shown in the colour space that its file is read in."""
    is_linear = hosts.is_linear(image) and not hosts.is_data(image)
    if image.file_format in _LINEAR_FILES:
        return is_linear
    return hosts.is_srgb(image) or is_linear and image.file_format == "TIFF" and image.is_float


def capture_of_row(row: bpy.types.PropertyGroup, scene: bpy.types.Scene) -> CaptureRequest:
    """One row of the panel, whether it is ticked or not."""
    return _of_row(row, {item: name for name, item in named_cameras(scene).items()})


def _of_row(row: bpy.types.PropertyGroup, names: dict[bpy.types.Object, str]) -> CaptureRequest:
    return CaptureRequest(
        camera=_name(row, names),
        photo=photo_name(row.photo) if row.photo is not None else "",
        **values_of_row(row),  # type: ignore[arg-type]
    )


def ids_of(scene: bpy.types.Scene) -> list[str]:
    """The id of each row of the panel, see `with_ids`; "" of a row that is off or has no camera."""
    rows = scene.selenite.captures
    names = {item: name for name, item in named_cameras(scene).items()}
    used = [_name(row, names) if row.enabled else "" for row in rows]
    requests = (CaptureRequest(name, "") for name in used if name)
    found = iter(with_ids(requests, names.values()))
    return [next(found).id if name else "" for name in used]


def _name(row: bpy.types.PropertyGroup, names: dict[bpy.types.Object, str]) -> str:
    """What the camera of a row is called, "" if it has none."""
    return names.get(row.camera, row.camera.name) if row.camera is not None else ""


def photo_name(image: bpy.types.Image) -> str:
    """The file of an image datablock, or PACKED and its name."""
    if image.packed_file is not None:
        return PACKED + image.name
    return bpy.path.abspath(image.filepath, library=image.library)


def packed_photos() -> dict[str, bytes]:
    """File contents of the packed images by PACKED name."""
    return {
        PACKED + image.name: image.packed_file.data
        for image in bpy.data.images
        if image.packed_file is not None
    }


def pair_by_name(cameras: list[str], photos: list[str]) -> tuple[list[CaptureRequest], list[str]]:
    """Captures, with ids, of the files that are named as one, "Camera.png" or "Camera#2.png" (case
    is ignored), and the photos that are left. With one camera and one photo names do not matter."""
    if len(cameras) == 1 and len(photos) == 1:
        return [CaptureRequest(cameras[0], photos[0], id=cameras[0])], []
    by_name = {name.casefold(): name for name in cameras}
    pairs: dict[str, CaptureRequest] = {}
    rest = []
    for photo in photos:
        stem = PurePath(photo).stem
        first, _, number = stem.rpartition("#")
        camera = by_name.get(stem.casefold())
        name = camera or ""
        if camera is None and number.isdecimal():
            camera = by_name.get(first.casefold())
            name = f"{camera}#{number}"
        if camera is None or name in pairs:
            rest.append(photo)
        else:
            pairs[name] = CaptureRequest(camera, photo, id=name)
    return list(pairs.values()), rest
