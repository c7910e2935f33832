# SPDX-License-Identifier: GPL-3.0-or-later
"""Which photo belongs to which camera. The photos themselves are read natively, by path."""

from __future__ import annotations

from pathlib import PurePath

import bpy

from .values import PACKED, CaptureRequest


def captures_of(scene: bpy.types.Scene) -> list[CaptureRequest]:
    """The scene's captures, or else the first background image of each camera."""
    settings = getattr(scene, "selenite", None)
    rows = [row for row in settings.captures if row.enabled] if settings is not None else []
    if rows:
        return [
            CaptureRequest(
                camera=row.camera.name if row.camera is not None else "",
                photo=photo_name(row.photo) if row.photo is not None else "",
                mask=bpy.path.abspath(row.mask_path),
            )
            for row in rows
        ]
    found = []
    for camera in scene.objects:
        if camera.type != "CAMERA":
            continue
        image = next((item.image for item in camera.data.background_images if item.image), None)
        if image is not None:
            found.append(CaptureRequest(camera.name, photo_name(image), ""))
    return found


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


def pair_by_name(cameras: list[str], photos: list[str]) -> tuple[dict[str, str], list[str]]:
    """camera -> photo where the file's stem is the camera's name (case is ignored), and the photos
    that are left. With one camera and one photo the names do not matter."""
    if len(cameras) == 1 and len(photos) == 1:
        return {cameras[0]: photos[0]}, []
    by_name = {name.casefold(): name for name in cameras}
    pairs: dict[str, str] = {}
    rest = []
    for photo in photos:
        camera = by_name.get(PurePath(photo).stem.casefold())
        if camera is None or camera in pairs:
            rest.append(photo)
        else:
            pairs[camera] = photo
    return pairs, rest
