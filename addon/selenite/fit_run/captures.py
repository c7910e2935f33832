# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos as the fit wants them: linear, of the working size, with a weight for every pixel."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import native
from ..problems import Problem, listed
from ..scene_read.capture_request import PACKED, CaptureRequest, with_ids
from ..scene_read.values import CameraValues, SceneValues
from .light_states import AS_IN_SCENE, light_state

#: How the warning begins that names them.
LEFT_OUT = "Cameras without a photo are left out"
READABLE = "give a whole PNG, JPEG, TIFF, OpenEXR or HDR file"

#: Why a pixel is not used, by its name in the counts of the native reader.
_UNUSED = {
    "not_finite": "not finite",
    "negative": "below 0",
    "clipped": "clipped",
    "outside_gamut": "outside Rec. 709",
    "outside_file": "not stored",
}


@dataclass(frozen=True)
class Capture:
    """A photo and its camera: reference (h, w, 3) float32 linear, weight (h, w) float32 in [0, 1];
    photo_size is (width, height) of the file. aspect is width / height of what the camera takes;
    that of the reference is only near it, for its width is a whole number. id: see CaptureRequest.
    gain: factor on what the camera renders, (r, g, b); as an unknown it starts elsewhere.
    lights: which were on, and where lamps stood: see light_states.light_state.
    warnings: what the reader says of photo and mask.
    """

    id: str
    camera: str
    photo: str
    photo_size: tuple[int, int]
    reference: np.ndarray
    weight: np.ndarray
    aspect: float
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    lights: Mapping[str, Any] = field(default_factory=lambda: dict(AS_IN_SCENE))
    warnings: tuple[str, ...] = ()

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
            "lights": self.lights,
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
            lights = light_state(scene, request, problems)
            captures += [replace(capture, lights=lights)] if capture is not None else []
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
    title, mask_title = f"Photo '{request.photo}'", f"Mask '{request.mask}'"
    found = len(problems)
    info = _header(title, request.photo, problems, packed, as_linear=True)
    mask = None
    if request.mask:
        mask = _header(mask_title, request.mask, problems, packed, as_linear=False)
    if info is None or len(problems) > found:
        return None
    size = (info["width"], info["height"])
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
    if mask is not None and (mask["width"], mask["height"]) != size:
        cause = f"it is {mask['width']} x {mask['height']} pixels, its photo {size[0]} x {size[1]}"
        problems.append(Problem(mask_title, cause, "give a mask of the photo's size"))
        return None
    rows = min(height, size[1])
    columns = min(size[0], max(1, round(rows * size[0] / size[1])))
    try:
        with _as_file(request.photo, packed) as path, _as_file(request.mask, packed) as mask_path:
            reference, weight, info, mask = native.image().read_at_size(
                path, columns, rows, mask_path or None
            )
    except (OSError, ValueError, MemoryError) as error:
        is_mask = bool(request.mask) and str(error).startswith(f"'{mask_path}'")
        problems.append(_unreadable(mask_title if is_mask else title, error))
        return None
    if not (weight > 0).any():
        cause = f"no pixel of it can be used ({_reasons(info['counts'])})"
        problems.append(Problem(title, cause, "give a better exposed photo or another mask"))
        return None
    remarks = [f"{title}: {text}" for text in info["warnings"]]
    if mask is not None:
        remarks += [f"{mask_title}: {text}" for text in mask["warnings"]]
    warnings += [text for text in remarks if text not in warnings]
    return Capture(
        request.id, camera.name, request.photo, size, reference, weight, camera.aspect,
        warnings=tuple(remarks),
    )  # fmt: skip


def _reasons(counts: Mapping[str, int]) -> str:
    """Why pixels do not count, with their share."""
    total = max(1, sum(counts.values()))
    shares = [
        f"{counts[name] / total:.0%} {text}" for name, text in _UNUSED.items() if counts[name]
    ]
    if counts["used"]:
        shares.append(f"{counts['used'] / total:.0%} masked, transparent, or next to such pixels")
    return ", ".join(shares)


def _header(
    title: str,
    name: str,
    problems: list[Problem],
    packed: Mapping[str, bytes],
    *,
    as_linear: bool,
) -> Mapping[str, Any] | None:
    """What the header of a photo or mask says; None, with a problem, if it cannot be read."""
    if not name.startswith(PACKED) and not Path(name).is_file():
        problems.append(Problem(title, "the file does not exist", "correct the path"))
        return None
    if name.startswith(PACKED) and name not in packed:
        problems.append(Problem(title, "the scene has no such image", "choose another photo"))
        return None
    try:
        with _as_file(name, packed) as path:
            return native.image().probe(path, as_linear=as_linear)
    except (OSError, ValueError, MemoryError) as error:
        problems.append(_unreadable(title, error))
        return None


def _unreadable(title: str, error: Exception) -> Problem:
    """Of the native reader, whose messages are: path in quotes, cause; cure."""
    text = re.sub(r"^'.*?' ", "it ", str(error), count=1)
    cause, _, cure = text.rpartition("; ")
    if not cause:
        cause, cure = text or type(error).__name__, READABLE
    return Problem(title, f"cannot be read: {cause}", cure)


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
