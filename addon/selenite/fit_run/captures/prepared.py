# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos as the fit wants them: linear, of the working size, with a weight for every pixel."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ... import native
from ...problems import Problem, choice, listed
from ...scene_read.capture_request import CaptureRequest, with_ids
from ...scene_read.values import CameraValues, SceneValues
from ..photos import distortion
from ..photos.files import MASK_TOLERANCE, as_file, header, pixels, same_aspect, unreadable
from ..photos.masks import background_of, masked
from ..photos.response import read_response
from ..photos.silhouette import Silhouettes
from ..photos.window import WHOLE, PhotoWindow, projection, window_of
from .light_states import AS_IN_SCENE, light_state

#: Names of cameras that a line has.
_FEW = 3
#: Why a pixel is not used, by its name in the counts of the native reader.
_UNUSED = {
    "not_finite": "not finite",
    "negative": "below 0",
    "clipped": "clipped",
    "too_dark": "too dark",
    "outside_gamut": "outside Rec. 709",
    "outside_file": "not stored",
}


Gain = tuple[float, float, float]
#: Of a camera, in pixels of its picture to the right and down, and in radians about its axis.
Alignment = tuple[float, float, float]
UNALIGNED: Alignment = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Capture:
    """A photo and its camera: reference (h, w, 3) float32 linear, weight (h, w) float32 in [0, 1];
    photo_size is (width, height) of the file. aspect: width / height of all that the camera takes;
    that of the reference is only near it, for its width is a whole number. id: see CaptureRequest.
    align: whether the fit finds a small shift and roll of it.
    free_gain: what the fit finds of a factor on `gain`, one of GAINS.
    window: what the photo shows of what the camera takes, left, top, right, bottom in [0, 1].
    gain: factor on what the camera renders, (r, g, b).
    alignment: of its camera, in pixels of the reference to the right and down, and radians about
    its axis.
    lights: which were on, and where lamps stood: see light_states.light_state.
    warnings: what the reader says of photo and mask.
    isolated: share of the photo's light in isolated bright pixels, as of a render that has not
    converged; 0 where it is not worth telling.
    """

    id: str
    camera: str
    photo: str
    photo_size: tuple[int, int]
    reference: np.ndarray
    weight: np.ndarray
    aspect: float
    gain: Gain = (1.0, 1.0, 1.0)
    free_gain: str = "none"
    align: bool = False
    lights: Mapping[str, Any] = field(default_factory=lambda: dict(AS_IN_SCENE))
    warnings: tuple[str, ...] = ()
    window: tuple[float, float, float, float] = WHOLE
    isolated: float = 0.0
    alignment: Alignment = UNALIGNED

    @property
    def frame(self) -> tuple[Any, ...]:
        """Aspect, width and height of the photo, and its window if it is cropped: makes a native
        render one of the reference."""
        return self._frame(*self.photo_size)

    @property
    def frame_of_render(self) -> tuple[Any, ...]:
        """The same of a picture that shows what the photo shows, with pixels of its own."""
        return self._frame(0, 0)

    def _frame(self, width: int, height: int) -> tuple[Any, ...]:
        whole = (self.aspect, width, height)
        return whole if self.window == WHOLE else (*whole, self.window)

    @property
    def mask_share(self) -> float:
        """The share of its pixels that count."""
        return float((self.weight > 0).mean())

    def pixel_aspect(self, camera: CameraValues) -> float:
        """Width / height of a pixel with which the reference holds all of its window."""
        height, width = self.reference.shape[:2]
        left, top, right, bottom = self.window
        aspect = self.aspect * (right - left) / (bottom - top)
        return aspect * height / width * camera.pixel_aspect_x / camera.pixel_aspect_y

    def native(self) -> Any:  # noqa: ANN401 - a native Photo
        """With its pixels: what a fit compares with."""
        return native.core().Photo(
            self.camera, self.reference, self.weight, free_gain=self.free_gain, align=self.align,
            frame=self.frame, alignment=self.alignment, **self._taken(),
        )  # fmt: skip

    def view(self, size: tuple[int, int] | None = None, *, of_file: bool = True) -> Any:  # noqa: ANN401 - a native Photo
        """Without pixels: what it shows, `size` (width, height) or that of the reference. of_file:
        as an area filter leaves the photo; else with pixels of its own."""
        rows, columns = self.reference.shape[:2]
        width, height = size or (columns, rows)
        across, down, roll = self.alignment
        return native.core().Photo(
            self.camera, size=(width, height),
            frame=self.frame if of_file else self.frame_of_render,
            alignment=(across * width / columns, down * height / rows, roll), **self._taken(),
        )  # fmt: skip

    def _taken(self) -> dict[str, Any]:
        return {"id": self.id, "lights": self.lights, "gain": self.gain}

    def small(self, size: tuple[int, int]) -> Capture:
        """The same photo at another size; each pixel is the mean over those that count in it."""
        counts = self.weight[..., None]
        planes = np.dstack([self.reference * counts, counts]).astype(np.float32)
        found = native.image().resize(np.ascontiguousarray(planes), *size)
        weight = np.maximum(found[..., 3], 0.0)
        picture = found[..., :3] / np.maximum(weight, 1e-6)[..., None]
        across, down, roll = self.alignment
        rows, columns = self.reference.shape[:2]
        moved = (across * size[0] / columns, down * size[1] / rows, roll)
        return replace(self, reference=picture, weight=weight, alignment=moved)


def read_captures(
    scene: SceneValues,
    requests: Sequence[CaptureRequest],
    height: int,
    problems: list[Problem],
    warnings: list[str],
    packed: Mapping[str, bytes],
    fitted: Collection[str] = (),
    *,
    go_on: Callable[[], None] = lambda: None,
) -> list[Capture]:
    """Reads every photo, of which several may be of one camera; all that is wrong goes to
    `problems`. fitted: the owners of what is fitted, whose silhouettes may be asked for.
    go_on: called before each photo, and may raise."""
    if not requests:
        cure = "give one with --photo CAMERA=FILE or in the Captures panel"
        problems.append(Problem("Fit", "there is no photo", cure))
    captures: list[Capture] = []
    cameras = {camera.name: camera for camera in scene.cameras}
    requests = with_ids(requests, cameras)
    used: set[str] = set()
    silhouettes = Silhouettes(scene, fitted)
    for request in requests:
        go_on()
        title = f"Photo '{request.photo}'"
        if not request.camera:
            problems.append(Problem(title, "it has no camera", "choose its camera"))
        elif request.camera not in cameras:
            reason = scene.unusable_cameras.get(request.camera, "it is not in the scene")
            cure = choice(request.camera, cameras)
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
            capture = _read(camera, request, height, silhouettes, problems, warnings, packed)
            lights = light_state(scene, request, problems)
            captures += [replace(capture, lights=lights)] if capture is not None else []
    return captures


def without_photo(scene: SceneValues, requests: Sequence[CaptureRequest]) -> str:
    """One line on the cameras that no photo belongs to; "" where there are none. It is no warning:
    a fit does not need them."""
    used = {item.camera for item in requests}
    names = [camera.name for camera in scene.cameras if camera.name not in used]
    if not names or not requests:
        return ""
    first = listed(names[:_FEW])
    rest = f" and {len(names) - _FEW} more" if len(names) > _FEW else ""
    return f"{len(names)} of {len(scene.cameras)} cameras have no photo: {first}{rest}"


def _read(
    camera: CameraValues,
    request: CaptureRequest,
    height: int,
    silhouettes: Silhouettes,
    problems: list[Problem],
    warnings: list[str],
    packed: Mapping[str, bytes],
) -> Capture | None:
    title, mask_title = f"Photo '{request.photo}'", f"Mask '{request.mask}'"
    exclude_title = f"Exclude '{request.exclude}'"
    found = len(problems)
    info = header(title, request.photo, problems, packed, as_linear=True)
    response = read_response(request.response, problems)
    masks = {
        name: header(name, file, problems, packed, as_linear=False)
        for name, file in ((mask_title, request.mask), (exclude_title, request.exclude))
        if file
    }
    background_of(request, problems)
    if info is None:
        return None
    size = (info["width"], info["height"])
    window = window_of(camera, request, size, info["orientation"], problems)
    for name, mask in masks.items():
        mask_size = (mask["width"], mask["height"]) if mask is not None else size
        if not same_aspect(mask_size, size, MASK_TOLERANCE):
            cause = f"it is {pixels(mask_size)}, its photo {size[0]} x {size[1]}"
            problems.append(Problem(name, cause, "give a mask of the photo's shape"))
    rows = min(height, size[1])
    columns = min(size[0], max(1, round(rows * size[0] / size[1])))
    remarks: list[str] = []
    corners = None
    if window is not None and request.distortion is not None:
        corners = _corners(camera, request, window, size, (columns, rows), problems, remarks)
    if window is None or len(problems) > found:
        return None
    try:
        with (
            as_file(request.photo, packed) as path,
            as_file(request.mask, packed) as mask_path,
            as_file(request.exclude, packed) as exclude_path,
        ):
            reference, weight, inside, info, mask = native.image().read_at_size(
                path, columns, rows, mask_path or None, exclude=exclude_path or None,
                response=response, counted=request.clip, corners=corners,
            )  # fmt: skip
    except (OSError, ValueError, MemoryError) as error:
        paths = {mask_title: mask_path, exclude_title: exclude_path}
        named = (n for n, file in paths.items() if file and str(error).startswith(f"'{file}'"))
        problems.append(unreadable(next(named, title), error))
        return None
    if not (weight > 0).any():
        cause = f"no pixel of it can be used ({_reasons(info['counts'])})"
        problems.append(Problem(title, cause, "give a better exposed photo or another mask"))
        return None
    remarks += [f"{title}: {text}" for text in info["warnings"]]
    if mask is not None:
        remarks += [f"{mask_title}: {text}" for text in mask["warnings"]]
    capture = Capture(
        request.id, camera.name, request.photo, size, reference, weight, window.aspect,
        window=window.fractions, free_gain=request.gain or "none",
        align=bool(request.align), isolated=info["isolated"],
    )  # fmt: skip
    weight = masked(
        request, reference, weight, inside, capture.frame, silhouettes, problems, remarks
    )
    if len(problems) > found:
        return None
    warnings += [text for text in remarks if text not in warnings]
    return replace(capture, weight=weight, warnings=tuple(remarks))


def _corners(
    camera: CameraValues,
    request: CaptureRequest,
    window: PhotoWindow,
    file_size: tuple[int, int],
    working_size: tuple[int, int],
    problems: list[Problem],
    remarks: list[str],
) -> np.ndarray | None:
    """Where the picture's pixels lie in a photo that its lens distorts."""
    assert request.distortion is not None  # noqa: S101 - asked for only then
    title = f"Photo '{request.photo}'"
    if camera.kind == "ORTHO":
        cause = f"it has a distortion, and its camera '{camera.name}' is orthographic"
        problems.append(Problem(title, cause, "use a perspective camera, or leave it out"))
        return None
    seen = projection(camera, window)
    differs = distortion.disagreement(request.distortion, seen, window)
    places = distortion.corners(request.distortion, seen, window, file_size, *working_size)
    if distortion.misses(places, file_size):
        cause = f"by its distortion it shows nothing of what camera '{camera.name}' takes"
        cure = "give fx, fy, cx, cy in pixels of the whole photo, and k1 to p2 for slopes"
        problems.append(Problem(title, cause, cure))
        return None
    found = (differs, distortion.folded(places))
    remarks += [f"{title}: {text}" for text in found if text]
    return places


def _reasons(counts: Mapping[str, int]) -> str:
    """Why pixels do not count, with their share."""
    total = max(1, sum(counts.values()))
    shares = [
        f"{counts[name] / total:.0%} {text}" for name, text in _UNUSED.items() if counts[name]
    ]
    if counts["used"]:
        shares.append(f"{counts['used'] / total:.0%} masked, transparent, or next to such pixels")
    return ", ".join(shares)
