# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos as the fit wants them: linear, of the working size, with a weight for every pixel."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypedDict

import numpy as np

from .. import native
from ..messages import control, remark, thing
from ..problems import Problem, choice, listed
from ..scene_read.lens import LensDistortion
from ..scene_read.values import CameraValues, SceneValues
from . import distortion
from .in_parallel import in_parallel
from .kept_lens import KeptLenses
from .light_states import AS_IN_SCENE, LightState, light_state
from .masks import background_of, masked, within_silhouette
from .photo_files import MASK_TOLERANCE, as_file, header, pixels, same_aspect, unreadable
from .request import CaptureRequest, with_ids
from .response import NativeResponse, read_response
from .silhouette import Silhouettes
from .window import WHOLE, PhotoWindow, projection, window_of

if TYPE_CHECKING:
    from .._core import Frame, Photo
    from .._image import CountedInfo, PhotoInfo

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


class _Taken(TypedDict):
    """How a photo was taken, whether its pixels are wanted or not."""

    id: str
    lights: LightState
    gain: Gain


@dataclass(frozen=True)
class Capture:
    """A photo and its camera: reference (h, w, 3) float32 linear, weight (h, w) float32 in [0, 1];
    photo_size is (width, height) of the file. aspect: width / height of all that the camera takes;
    that of the reference is only near it, for its width is a whole number. id: see CaptureRequest.
    of_fit: what a fit finds of it, see CaptureRequest.of_fit.
    window: what the photo shows of what the camera takes, left, top, right, bottom in [0, 1].
    gain: factor on what the camera renders, (r, g, b).
    alignment: of its camera, in pixels of the reference to the right and down, and radians about
    its axis.
    lights: which were on, and where lamps stood: see light_states.light_state.
    warnings: what the reader says of photo and mask.
    isolated: share of the photo's light in isolated bright pixels, as of a render that has not
    converged; 0 where it is not worth telling.
    coverage: (h, w), the share of each pixel that shows the object by the photo's masks; None
    without any.
    """

    id: str
    camera: str
    photo: str
    photo_size: tuple[int, int]
    reference: np.ndarray
    weight: np.ndarray
    aspect: float
    gain: Gain = (1.0, 1.0, 1.0)
    of_fit: Mapping[str, object] = field(default_factory=dict)
    lights: LightState = field(default_factory=AS_IN_SCENE.copy)
    warnings: tuple[str, ...] = ()
    window: tuple[float, float, float, float] = WHOLE
    isolated: float = 0.0
    alignment: Alignment = UNALIGNED
    coverage: np.ndarray | None = None

    @property
    def free_gain(self) -> str:
        """What the fit finds of a factor on `gain`, one of GAINS."""
        return str(self.of_fit.get("free_gain", "none"))

    @property
    def align(self) -> bool:
        """Whether the fit finds a small shift and roll of it."""
        return bool(self.of_fit.get("align"))

    @property
    def frame(self) -> Frame:
        """Aspect, width and height of the photo, and its window if it is cropped: makes a native
        render one of the reference."""
        return self._frame(*self.photo_size)

    @property
    def frame_of_render(self) -> Frame:
        """The same of a picture that shows what the photo shows, with pixels of its own."""
        return self._frame(0, 0)

    def _frame(self, width: int, height: int) -> Frame:
        return frame_of(self.aspect, (width, height), self.window)

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

    def native(self) -> Photo:
        """With its pixels: what a fit compares with."""
        return native.core().Photo(
            self.camera, self.reference, self.weight,
            frame=self.frame, alignment=self.alignment, coverage=self.coverage, **self._taken(),
            **self.of_fit,  # type: ignore[arg-type]
        )  # fmt: skip

    def view(self, size: tuple[int, int] | None = None, *, of_file: bool = True) -> Photo:
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

    def _taken(self) -> _Taken:
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
        coverage = self.coverage
        if coverage is not None:
            coverage = native.image().resize(np.ascontiguousarray(coverage[..., None]), *size)
            coverage = np.clip(coverage[..., 0], 0, 1)
        return replace(self, reference=picture, weight=weight, alignment=moved, coverage=coverage)


def frame_of(
    aspect: float, size: tuple[int, int], window: tuple[float, float, float, float]
) -> Frame:
    """What makes a native render one of a photo: see `Capture.frame`."""
    whole = (aspect, *size)
    return whole if window == WHOLE else (*whole, window)


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
    go_on: called while photos are decoded, once for each at least, and may raise. Photos are
    decoded side by side; what is said of them keeps their order."""
    if not requests:
        cure = control("give-photo", "give one with --photo CAMERA=FILE")
        problems.append(Problem("Fit", "there is no photo", cure))
    cameras = {camera.name: camera for camera in scene.cameras}
    requests = with_ids(requests, cameras)
    lenses, used = KeptLenses(), set[str]()
    silhouettes = Silhouettes(scene, fitted)
    opened: list[_Opened | None] = []
    states: list[LightState] = []
    said: list[list[Problem]] = []
    for request in requests:
        said.append([])
        title = thing("Photo", request.photo)
        if not request.camera:
            said[-1].append(Problem(title, "it has no camera", "choose its camera"))
        elif request.camera not in cameras:
            reason = scene.unusable_cameras.get(request.camera, "it is not in the scene")
            cure = choice(request.camera, cameras)
            said[-1].append(Problem(thing("Camera", request.camera), reason, cure))
        elif request.id in used:
            cause, cure = "another photo has its id", "give each photo an id of its own"
            said[-1].append(Problem(thing("Photo", request.id), cause, cure))
        elif not request.photo:
            cause = "it has no photo"
            cure = "choose a photo or remove the row"
            said[-1].append(Problem(thing("Camera", request.camera), cause, cure))
        else:
            used.add(request.id)
            camera = cameras[request.camera]
            opened.append(_open(camera, request, height, lenses, silhouettes, said[-1], packed))
            go_on()
            states.append(light_state(scene, request, said[-1]))
            continue
        opened.append(None)
        states.append(AS_IN_SCENE)
    captures: list[Capture] = []
    decoded = in_parallel(
        [None if item is None else partial(item.decode, packed) for item in opened],
        [0 if item is None else item.size[0] * item.size[1] for item in opened],
        go_on,
    )
    for item, lights, shown, found in zip(opened, states, decoded, said, strict=True):
        if item is not None and shown is not None:
            capture = _finish(item, shown, found, warnings)
            captures += [replace(capture, lights=lights)] if capture is not None else []
        problems += found
    warnings += lenses.remarks()
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


#: Reference, weight, inside, and what is known of photo and masks; or why there is none.
_Decoded: TypeAlias = (
    "tuple[np.ndarray, np.ndarray, np.ndarray, PhotoInfo, list[CountedInfo]] | Problem"
)


@dataclass(frozen=True)
class _Opened:
    """A photo whose header agrees with what is said of it. size: of the file, (width, height).
    working_size: (columns, rows). silhouette: see `within_silhouette`. remarks: what has to be
    said of it so far."""

    camera: CameraValues
    request: CaptureRequest
    size: tuple[int, int]
    working_size: tuple[int, int]
    window: PhotoWindow
    corners: np.ndarray | None
    response: NativeResponse | None
    silhouette: np.ndarray | None
    remarks: list[str]

    def decode(self, packed: Mapping[str, bytes]) -> _Decoded:
        """Its pixels at the working size; may run beside others."""
        request, paths = self.request, dict[str, str]()
        try:
            with ExitStack() as files:
                path = files.enter_context(as_file(request.photo, packed))
                masks = []
                for title, (name, left_out) in request.masks().items():
                    paths[title] = files.enter_context(as_file(name, packed))
                    masks.append((paths[title], left_out))
                found: _Decoded = native.image().read_at_size(
                    path, *self.working_size, masks=masks, response=self.response,
                    counted=request.clip, corners=self.corners, within=self.silhouette,
                )  # fmt: skip
        except (OSError, ValueError, MemoryError) as error:
            named = (name for name, file in paths.items() if str(error).startswith(f"'{file}'"))
            return unreadable(next(named, thing("Photo", request.photo)), error)
        return found


def _open(
    camera: CameraValues,
    request: CaptureRequest,
    height: int,
    lenses: KeptLenses,
    silhouettes: Silhouettes,
    problems: list[Problem],
    packed: Mapping[str, bytes],
) -> _Opened | None:
    title = thing("Photo", request.photo)
    info = header(title, request.photo, problems, packed, as_linear=True)
    response = read_response(request.response, problems)
    masks = {
        name: header(name, file, problems, packed, as_linear=False)
        for name, (file, _) in request.masks().items()
    }
    background_of(request, problems)
    if info is None:
        return None
    size = (info["width"], info["height"])
    request = lenses.given_to(request, camera, size)
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
    if window is not None and isinstance(request.distortion, LensDistortion):
        corners = _corners(
            camera, request, request.distortion, window, size, (columns, rows), problems, remarks
        )
    if window is None or problems:
        return None
    frame = frame_of(window.aspect, size, window.fractions)
    inside = within_silhouette(request, (columns, rows), frame, silhouettes, problems)
    if problems:
        return None
    return _Opened(
        camera, request, size, (columns, rows), window, corners, response, inside, remarks
    )


def _finish(
    opened: _Opened,
    decoded: _Decoded,
    problems: list[Problem],
    warnings: list[str],
) -> Capture | None:
    request, window, remarks = opened.request, opened.window, list(opened.remarks)
    title = thing("Photo", request.photo)
    if isinstance(decoded, Problem):
        problems.append(decoded)
        return None
    reference, weight, inside, info, masks = decoded
    if not (weight > 0).any():
        cause = f"no pixel of it can be used ({_reasons(info['counts'])})"
        problems.append(Problem(title, cause, "give a better exposed photo or another mask"))
        return None
    remarks += [remark(title, text) for text in info["warnings"]]
    for name, mask in zip(request.masks(), masks, strict=True):
        remarks += [remark(name, text) for text in mask["warnings"]]
    capture = Capture(
        request.id, opened.camera.name, request.photo, opened.size, reference, weight,
        window.aspect, window=window.fractions, of_fit=request.of_fit(),
        isolated=info["isolated"],
    )  # fmt: skip
    weight, coverage = masked(
        request, reference, weight, inside, opened.silhouette, problems, remarks
    )
    if problems:
        return None
    warnings += [text for text in remarks if text not in warnings]
    return replace(capture, weight=weight, coverage=coverage, warnings=tuple(remarks))


def _corners(
    camera: CameraValues,
    request: CaptureRequest,
    lens: LensDistortion,
    window: PhotoWindow,
    file_size: tuple[int, int],
    working_size: tuple[int, int],
    problems: list[Problem],
    remarks: list[str],
) -> np.ndarray | None:
    """Where the picture's pixels lie in a photo that its lens distorts."""
    title = thing("Photo", request.photo)
    if camera.kind == "ORTHO":
        cause = f"it has a distortion, and its camera '{camera.name}' is orthographic"
        problems.append(Problem(title, cause, "use a perspective camera, or leave it out"))
        return None
    seen = projection(camera, window)
    differs = distortion.disagreement(lens, seen, window)
    places = distortion.corners(lens, seen, window, file_size, *working_size)
    if distortion.misses(places, file_size):
        cause = f"by its distortion it shows nothing of what camera '{camera.name}' takes"
        cure = "give fx, fy, cx, cy in pixels of the whole photo, and k1 to p2 for slopes"
        problems.append(Problem(title, cause, cure))
        return None
    found = (differs, distortion.folded(places))
    remarks += [remark(title, text) for text in found if text]
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
