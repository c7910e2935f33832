# SPDX-License-Identifier: GPL-3.0-or-later
"""How many pixels a baked image has: about two along each pixel of the photos."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..values import CameraValues, SceneValues
from .wanted import WantedMaterial

SMALLEST, LARGEST = 256, 4096
_TEXELS_PER_PIXEL = 2
#: Vertices that are enough to see how far an object extends.
_PROBED = 5000


def longest_photo(scene: bpy.types.Scene) -> int:
    """Pixels along the longest side of the scene's photos; 0 where it names none."""
    settings = getattr(scene, "selenite", None)
    images = [row.photo for row in settings.captures if row.enabled] if settings else []
    for item in scene.objects:
        if item.type == "CAMERA":
            images += [background.image for background in item.data.background_images]
    return max((max(image.size) for image in images if image is not None), default=0)


def side_of(wanted: WantedMaterial, read: SceneValues, photo: int) -> tuple[int, int]:
    """(pixels along a side, tiles along a side): each object has a tile. photo: see
    `longest_photo`."""
    tiles = math.ceil(math.sqrt(len(wanted.users)))
    extent = max(
        (
            _extent(read, place, camera, max(photo, camera.width, camera.height))
            for places in wanted.places.values()
            for place in places
            for camera in read.cameras
        ),
        default=0.0,
    )
    texels = min(max(_TEXELS_PER_PIXEL * extent * tiles, SMALLEST), LARGEST)
    return 2 ** math.ceil(math.log2(texels)), tiles


def _extent(read: SceneValues, place: int, camera: CameraValues, longest: int) -> float:
    """Pixels that an object takes along the longer side of its picture, as if the frame went on."""
    item = read.objects[place]
    positions = read.meshes[item.mesh].positions
    few = positions[:: max(1, len(positions) // _PROBED)].astype(np.float64)
    to_camera = np.linalg.inv(camera.matrix) @ item.matrix
    x, y, z = (few @ to_camera[:3, :3].T + to_camera[:3, 3]).T
    if camera.kind == "ORTHO":
        scale = longest / max(camera.ortho_scale, 1e-9)
        return float(scale * max(np.ptp(x), np.ptp(y)))
    near = -z > max(camera.clip_start, 1e-6)
    if not near.any():
        return 0.0
    scale = longest * camera.lens_mm / max(camera.sensor_width, camera.sensor_height, 1e-6)
    x, y, depth = x[near], y[near], -z[near]
    return float(scale * max(np.ptp(x / depth), np.ptp(y / depth)))
