# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos as the fit wants them: linear, of the working size, with a weight for every pixel."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import native
from ..problems import Problem, listed
from ..scene_read.values import PACKED, CameraValues, CaptureRequest, SceneValues, with_ids

#: How the warning begins that names them.
LEFT_OUT = "Cameras without a photo are left out"


@dataclass(frozen=True)
class Capture:
    """A photo and its camera: reference (h, w, 3) float32 linear, weight (h, w) float32 in [0, 1];
    photo_size is (width, height) of the file. aspect is width / height of what the camera takes;
    that of the reference is only near it, for its width is a whole number. id: see CaptureRequest.
    gain: factor on what the camera renders, (r, g, b); as an unknown it starts elsewhere.
    lamps_off: names of the lamps that were off when it was taken.
    """

    id: str
    camera: str
    photo: str
    photo_size: tuple[int, int]
    reference: np.ndarray
    weight: np.ndarray
    aspect: float
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    lamps_off: tuple[str, ...] = ()

    @property
    def frame(self) -> tuple[float, int, int]:
        """(aspect, width, height) of the photo: makes a native render one of the reference."""
        return (self.aspect, *self.photo_size)

    def pixel_aspect(self, camera: CameraValues) -> float:
        """Width / height of a pixel with which the reference holds all that its camera takes."""
        height, width = self.reference.shape[:2]
        return self.aspect * height / width * camera.pixel_aspect_x / camera.pixel_aspect_y

    def native(self) -> dict[str, Any]:
        """What the native Fit takes."""
        return {
            "id": self.id,
            "camera": self.camera,
            "reference": self.reference,
            "weight": self.weight,
            "frame": self.frame,
            "gain": self.gain,
            "lamps_off": list(self.lamps_off),
        }


def read_captures(
    scene: SceneValues,
    requests: Sequence[CaptureRequest],
    height: int,
    problems: list[Problem],
    warnings: list[str],
    packed: Mapping[str, bytes],
) -> list[Capture]:
    """Reads every photo, of which several may be of one camera; all that is wrong goes to
    `problems`."""
    if not requests:
        cure = "give one with --photo CAMERA=FILE or in the Captures panel"
        problems.append(Problem("Fit", "there is no photo", cure))
    captures: list[Capture] = []
    cameras = {camera.name: camera for camera in scene.cameras}
    requests = with_ids(requests, cameras)
    used: set[str] = set()
    for request in requests:
        title = f"Photo '{request.photo}'"
        if not request.camera:
            problems.append(Problem(title, "it has no camera", "choose its camera"))
        elif request.camera not in cameras:
            reason = scene.unusable_cameras.get(request.camera, "it is not in the scene")
            cure = f"use one of {listed(cameras)}"
            problems.append(Problem(f"Camera '{request.camera}'", reason, cure))
        elif request.id in used:
            cause, cure = "another photo has its id", "give each photo an id of its own"
            problems.append(Problem(f"Photo '{request.id}'", cause, cure))
        elif not request.photo:
            cause = "it has no photo"
            cure = "choose a photo or remove the row"
            problems.append(Problem(f"Camera '{request.camera}'", cause, cure))
        else:
            used.add(request.id)
            camera = cameras[request.camera]
            capture = _read(camera, request, height, problems, warnings, packed)
            captures += [capture] if capture is not None else []
    left_out = [name for name in cameras if name not in {item.camera for item in requests}]
    if requests and left_out:
        warnings.append(f"{LEFT_OUT}: {listed(left_out)}")
    return captures


def _read(
    camera: CameraValues,
    request: CaptureRequest,
    height: int,
    problems: list[Problem],
    warnings: list[str],
    packed: Mapping[str, bytes],
) -> Capture | None:
    title = f"Photo '{request.photo}'"
    read = _read_file(title, request.photo, problems, packed, as_linear=True)
    if read is None:
        return None
    pixels, alpha, info = read
    size = (pixels.shape[1], pixels.shape[0])
    if not _same_aspect(size, (camera.width, camera.height)):
        problems.append(
            Problem(
                title,
                f"it is {size[0]} x {size[1]} pixels, camera '{camera.name}' renders "
                f"{camera.width} x {camera.height}",
                "crop the photo or change the resolution of the scene to the same aspect",
            )
        )
        return None
    if info.get("orientation", 1) not in (0, 1):
        warnings.append(f"{title} asks to be rotated (EXIF); it is read as Blender shows it")
    weight = np.ones(pixels.shape[:2], np.float32) if alpha is None else alpha.copy()
    if request.mask:
        mask_title = f"Mask '{request.mask}'"
        mask = _read_file(mask_title, request.mask, problems, packed, as_linear=False)
        if mask is None:
            return None
        if mask[0].shape != pixels.shape:
            cause = (
                f"it is {mask[0].shape[1]} x {mask[0].shape[0]} pixels, "
                f"its photo {size[0]} x {size[1]}"
            )
            problems.append(Problem(mask_title, cause, "give a mask of the photo's size"))
            return None
        weight *= np.clip(np.nan_to_num(mask[0].mean(axis=2)), 0, 1)
    reference, weight = _at_working_size(pixels, weight, info, min(height, size[1]))
    if not (weight > 0).any():
        cause = "no pixel of it can be used (masked, transparent, clipped or not finite)"
        problems.append(Problem(title, cause, "give a better exposed photo or another mask"))
        return None
    clipped = info.get("clipped")
    if clipped is not None and clipped.mean() > 0.001:
        warnings.append(f"{title}: {clipped.mean():.1%} of its pixels are clipped and do not count")
    return Capture(request.id, camera.name, request.photo, size, reference, weight, camera.aspect)


def _at_working_size(
    pixels: np.ndarray, weight: np.ndarray, info: Mapping[str, Any], height: int
) -> tuple[np.ndarray, np.ndarray]:
    """Area-filtered to `height`. A pixel counts only if all photo pixels in it can be used, so that
    neither the background nor a clipped highlight bleeds into it."""
    width = max(1, round(height * pixels.shape[1] / pixels.shape[0]))
    finite = np.isfinite(pixels).all(axis=2)
    usable = finite & (weight > 0)
    clipped = info.get("clipped")
    if clipped is not None:
        usable &= ~np.asarray(clipped, bool)
    resize = native.image().resize
    clean = np.where(finite[..., None], pixels, np.float32(0))
    planes = np.dstack([clean, weight, usable]).astype(np.float32)
    small = resize(np.ascontiguousarray(planes), width, height)
    weight = np.where(small[..., 4] > 0.9999, small[..., 3], 0)
    return (
        np.ascontiguousarray(small[..., :3], np.float32),
        np.ascontiguousarray(weight, np.float32),
    )


def _read_file(
    title: str,
    name: str,
    problems: list[Problem],
    packed: Mapping[str, bytes],
    *,
    as_linear: bool,
) -> tuple[np.ndarray, np.ndarray | None, Mapping[str, Any]] | None:
    if not name.startswith(PACKED) and not Path(name).is_file():
        problems.append(Problem(title, "the file does not exist", "correct the path"))
        return None
    if name.startswith(PACKED) and name not in packed:
        problems.append(Problem(title, "the scene has no such image", "choose another photo"))
        return None
    try:
        with _as_file(name, packed) as path:
            return native.image().read(path, as_linear=as_linear)
    except (OSError, ValueError) as error:
        cure = "give a whole PNG, JPEG, TIFF, OpenEXR or HDR file"
        problems.append(Problem(title, f"cannot be read ({error})", cure))
        return None


@contextmanager
def _as_file(name: str, packed: Mapping[str, bytes]) -> Iterator[str]:
    if name not in packed:
        yield name
        return
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        path = Path(folder) / "photo"
        path.write_bytes(packed[name])
        yield str(path)


def _same_aspect(first: tuple[int, int], second: tuple[int, int]) -> bool:
    """Equal up to one pixel of the smaller picture, since sizes are whole numbers."""
    ratio = first[0] * second[1] / (first[1] * second[0])
    return abs(ratio - 1) <= 1.0 / min(*first, *second)
