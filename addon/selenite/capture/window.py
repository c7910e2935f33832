# SPDX-License-Identifier: GPL-3.0-or-later
"""What a photo's file shows of what its camera takes: size of the whole photo, crop, pixel aspect.

A camera takes what Blender renders of it at the size of the whole photo. With sensor fit Auto the
focal length refers to the longer side, so a portrait photo is that of the same camera turned.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..problems import Problem
from ..scene_read.values import CameraValues
from .photo_files import pixels, same_aspect
from .request import CaptureRequest

#: (left, top, right, bottom) in [0, 1] of a photo that is not cropped.
WHOLE = (0.0, 0.0, 1.0, 1.0)
#: The kind of the Problem of a photo whose shape is not that of its camera.
ASPECT = "aspect"
#: Exif orientations that exchange width and height when a viewer shows the photo.
_ON_ITS_SIDE = (5, 6, 7, 8)


@dataclass(frozen=True)
class PhotoWindow:
    """size: (width, height) of the whole photo in pixels. crop: what the file holds of it, in these
    pixels from the top left corner. aspect: width / height of the whole photo, as counted in pixels
    of the scene's pixel aspect."""

    size: tuple[int, int]
    crop: tuple[int, int, int, int]
    aspect: float

    @property
    def fractions(self) -> tuple[float, float, float, float]:
        """The crop in [0, 1]."""
        width, height = self.size
        left, top, right, bottom = self.crop
        return left / width, top / height, right / width, bottom / height


def window_of(
    camera: CameraValues,
    request: CaptureRequest,
    file_size: tuple[int, int],
    orientation: int,
    problems: list[Problem],
) -> PhotoWindow | None:
    """The window of a photo whose file has so many pixels; None, with a problem, if what is said of
    them does not agree. orientation: Exif's, which is reported and not applied."""
    title = f"Photo '{request.photo}'"
    size, crop = request.size or file_size, request.crop
    turned = ""
    if orientation in _ON_ITS_SIDE:
        turned = f" (its Exif orientation is {orientation}: viewers show it on its side)"
    if crop is not None and request.size is None:
        cure = "give the 'size' of the whole photo too"
        problems.append(Problem(title, "its 'crop' is of a photo of unknown size", cure))
        return None
    if min(size) < 1:
        cure = "give width and height in pixels, each at least 1"
        problems.append(Problem(title, f"its 'size' is {pixels(size)}", cure))
        return None
    if crop is None:
        crop = (0, 0, *size)
    left, top, right, bottom = crop
    if not (left < right <= size[0] and top < bottom <= size[1]):
        cure = "give x0, y0, x1, y1 with x0 < x1 and y0 < y1, inside of the whole photo"
        cause = f"its 'crop' {list(crop)} is no part of {pixels(size)}"
        problems.append(Problem(title, cause, cure))
        return None
    if not same_aspect(file_size, (right - left, bottom - top)):
        key = "crop" if request.crop is not None else "size"
        cause = (
            f"it is {pixels(file_size)}, by its '{key}' it has the shape of "
            f"{right - left} x {bottom - top}{turned}"
        )
        cure = "give the 'size' of the whole photo and the 'crop' that the file holds of it"
        problems.append(Problem(title, cause, cure))
        return None
    if request.size is not None or request.pixel_aspect is not None:
        scene = camera.pixel_aspect_x / camera.pixel_aspect_y
        own = request.pixel_aspect if request.pixel_aspect is not None else scene
        return PhotoWindow(size, crop, size[0] / size[1] * own / scene)
    if not same_aspect(file_size, (camera.width, camera.height)):
        cause = (
            f"it is {pixels(file_size)}, camera '{camera.name}' renders "
            f"{camera.width} x {camera.height}{turned}"
        )
        cure = (
            f"give its 'size', {list(file_size)} for a whole photo, in the captures or the panel, "
            "or change the resolution of the scene to the same aspect"
        )
        problems.append(Problem(title, cause, cure, ASPECT))
        return None
    return PhotoWindow(size, crop, camera.aspect)


@dataclass(frozen=True)
class Projection:
    """From the whole photo's pixels to slopes against the camera's axis, x to the right and y down:
    slope = (pixel - centre) / focal. Of an orthographic camera these are lengths."""

    focal: tuple[float, float]
    centre: tuple[float, float]


def projection(camera: CameraValues, window: PhotoWindow) -> Projection:
    """As Blender renders the camera at the size of the whole photo."""
    width, height = window.size
    # In units of a pixel's height.
    across = window.aspect * height * camera.pixel_aspect_x / camera.pixel_aspect_y
    down = float(height)
    vertical = camera.sensor_fit == "VERTICAL"
    horizontal = camera.sensor_fit == "HORIZONTAL" or (not vertical and across > down)
    fit = across if horizontal else down
    sensor = camera.sensor_height if vertical else camera.sensor_width
    focal = fit / camera.ortho_scale if camera.kind == "ORTHO" else camera.lens_mm / sensor * fit
    pixel = across / width
    return Projection(
        (focal / pixel, focal),
        ((across / 2 - camera.shift_x * fit) / pixel, down / 2 + camera.shift_y * fit),
    )


def cropped_camera(
    camera: CameraValues, aspect: float, window: tuple[float, float, float, float]
) -> CameraValues:
    """A camera that takes only the window, in as many pixels as one will: the same rays. `aspect`:
    see PhotoWindow. Its pixel aspect stays that of the scene."""
    if window == WHOLE:
        return camera
    rows = 1_000_000  # of the whole photo: only ratios matter
    whole = PhotoWindow((rows, rows), (0, 0, rows, rows), aspect)
    seen = projection(camera, whole)
    left, top, right, bottom = np.array(window) * rows
    across, down = (right - left) / seen.focal[0], (bottom - top) / seen.focal[1]
    middle_x = ((left + right) / 2 - seen.centre[0]) / seen.focal[0]
    middle_y = ((top + bottom) / 2 - seen.centre[1]) / seen.focal[1]
    return replace(
        camera,
        sensor_fit="HORIZONTAL",
        lens_mm=camera.lens_mm if camera.kind == "ORTHO" else camera.sensor_width / across,
        ortho_scale=across if camera.kind == "ORTHO" else camera.ortho_scale,
        shift_x=middle_x / across,
        shift_y=-middle_y / across,
        width=max(1, round(1000 * across / down)),
        height=1000,
    )
