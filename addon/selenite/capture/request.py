# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked for of a photo, and the JSON of it: run.json and --captures hold the same."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

from ..problems import choice
from ..scene_read.lens import LensDistortion

#: A photo that is packed in the .blend: this and the name of its image.
PACKED = "packed:"
#: Degrees of freedom of a photo's gain: none, one for all channels, one for each.
GAINS = ("none", "scalar", "rgb")
#: Responses that have a name; GAMMA is followed by an exponent, all else is a file.
AUTO_RESPONSE, GAMMA = "auto", "gamma:"
RESPONSES = (AUTO_RESPONSE, "srgb", "linear")
#: Numbers that say where a lamp was: a place, with a quaternion, a matrix.
PLACES = (3, 7, 16)
#: Of a scene in Blender.
FRAMES = (-1048574, 1048574)
#: Beyond any number of a request.
LARGEST = 1e300
#: Pixels that can be taken off a silhouette.
MOST_ERODED = 100


@dataclass(frozen=True)
class CaptureRequest:
    """A camera, a photo from there, and how it was taken.

    mask: a picture whose black pixels do not count, or "".
    id: unique in a run; "" for the usual one, see `with_ids`.
    gain: one of GAINS, or "" for that of the run.
    lights: the lamps that were on; None: all. world: whether the world's light was on.
    transforms: where lamps were, in world space, by the object's name: a place (3 numbers), a place
    and a quaternion (w, x, y, z: 7 in all), or object to world row by row (16); what is not given
    stays as in the scene. frame: lamps stand as at this frame of the scene; None: as they are.
    response: "auto" (as the file says), "srgb", "linear", "gamma:2.2", or a .csv of a table.
    size: (width, height) of the whole photo in pixels; None: that of the file.
    crop: the part of it that the file holds, x0, y0, x1, y1 in pixels from the top left corner.
    distortion: of the lens; None: that of its camera, if an import has kept one (CameraLens);
    False: the photo is free of it.
    align: whether the fit finds a small shift and roll of the photo; None: as the run says.
    pixel_aspect: width / height of the photo's pixels; None: that of the scene.
    clip: lowest and highest code value that counts, 1 at the top of integers; None: clipping is
    looked for.
    silhouette: pixels that are taken off the rim of what the camera sees of the fitted objects;
    None: the photo counts beside them too.
    background: what does not count, "border" (what joins the photo's border in one colour) or
    "R,G,B" in linear light, either with a tolerance as in "border:0.1"; "": nothing.
    exclude: a picture whose white pixels do not count, or "".
    hold_out: a fit does not see it, and is judged by it.
    """

    camera: str
    photo: str
    mask: str = ""
    id: str = ""
    gain: str = ""
    lights: tuple[str, ...] | None = None
    world: bool = True
    transforms: tuple[tuple[str, tuple[float, ...]], ...] = ()
    frame: int | None = None
    response: str = AUTO_RESPONSE
    size: tuple[int, int] | None = None
    crop: tuple[int, int, int, int] | None = None
    distortion: LensDistortion | bool | None = None
    align: bool | None = None
    pixel_aspect: float | None = None
    clip: tuple[float, float] | None = None
    silhouette: int | None = None
    background: str = ""
    exclude: str = ""
    hold_out: bool = False

    def files(self) -> dict[str, str]:
        """The files that it names, by what they are called in messages."""
        found = {f"Photo '{self.photo}'": self.photo}
        if self.mask:
            found[f"Mask '{self.mask}'"] = self.mask
        if self.exclude:
            found[f"Exclude '{self.exclude}'"] = self.exclude
        if self.response_file:
            found[f"Response '{self.response}'"] = self.response
        return found

    @property
    def response_file(self) -> str:
        """The file of its response, "" if that has a name."""
        return (
            "" if self.response in RESPONSES or self.response.startswith(GAMMA) else self.response
        )

    def as_json(self) -> dict[str, object]:
        """A dict of plain values, without what is as usual."""
        usual = CaptureRequest(self.camera, self.photo)
        found: dict[str, object] = {"camera": self.camera, "photo": self.photo}
        for item in fields(self):
            value = getattr(self, item.name)
            if value == getattr(usual, item.name):
                continue
            if item.name == "transforms":
                value = {name: _rows(numbers) for name, numbers in value}
            elif isinstance(value, LensDistortion):
                value = value.as_json()
            elif isinstance(value, tuple):
                value = list(value)
            found[item.name] = value
        return found

    @staticmethod
    def from_json(data: Mapping[str, object]) -> CaptureRequest:
        """The inverse. Raises ValueError, whose text says which key is wrong and what it may be."""
        known = {entry.name for entry in fields(CaptureRequest)}
        for key in data:
            if key not in known:
                raise ValueError(f"its key '{key}' is not known; {choice(key, sorted(known))}")
        return CaptureRequest(
            camera=_text(data, "camera"),
            photo=_text(data, "photo"),
            mask=_text(data, "mask", ""),
            id=_text(data, "id", ""),
            gain=_gain(data),
            lights=_lights(data),
            world=_flag(data, "world", True) is not False,
            transforms=_transforms(data),
            frame=_frame(data),
            response=_text(data, "response", AUTO_RESPONSE),
            size=_whole(data, "size", 2),  # type: ignore[arg-type]
            crop=_whole(data, "crop", 4),  # type: ignore[arg-type]
            distortion=_distortion(data),
            align=_flag(data, "align", None),
            pixel_aspect=_pixel_aspect(data),
            clip=_clip(data),
            silhouette=_silhouette(data),
            background=_text(data, "background", ""),
            exclude=_text(data, "exclude", ""),
            hold_out=_flag(data, "hold_out", False) is True,
        )


def with_ids(
    captures: Iterable[CaptureRequest], cameras: Iterable[str] = ()
) -> tuple[CaptureRequest, ...]:
    """The captures, each with an id: its own, else its camera's name, or `Camera#2`, `Camera#3` ...
    where the camera repeats. None of these is the name of another one of `cameras`."""
    captures = tuple(captures)
    names = {*cameras, *(item.camera for item in captures)}
    taken = {item.id for item in captures if item.id}
    found = []
    for item in captures:
        if item.camera and not item.id:
            numbered = (f"{item.camera}#{number}" for number in itertools.count(2))
            free = (name for name in numbered if name not in taken and name not in names)
            item = replace(item, id=next(free) if item.camera in taken else item.camera)
            taken.add(item.id)
        found.append(item)
    return tuple(found)


def _text(data: Mapping[str, object], key: str, default: str | None = None) -> str:
    value = data.get(key, default)
    if value is None and default is not None:
        return default
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(f"its '{key}' is {value!r}, not text")
    return value


def _gain(data: Mapping[str, object]) -> str:
    value = _text(data, "gain", "")
    if value and value not in GAINS:
        raise ValueError(f"its 'gain' is {value!r}, not one of {', '.join(GAINS)}")
    return value


def _flag(data: Mapping[str, object], key: str, default: bool | None) -> bool | None:
    value = data.get(key)
    if value is None:
        return default
    if not isinstance(value, bool):
        raise ValueError(f"its '{key}' is {value!r}, not true or false")
    return value


def _lights(data: Mapping[str, object]) -> tuple[str, ...] | None:
    value = data.get("lights")
    if value is None:
        return None
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise ValueError(f"its 'lights' are {value!r}, not a list of names of lamps")
    return tuple(value)


def _numbers(value: object, key: str, count: int) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"its '{key}' is {value!r}, not a list of {count} numbers")
    for item in value:
        if type(item) not in (int, float) or not abs(item) <= LARGEST:
            raise ValueError(f"its '{key}' holds {item!r}, not a finite number")
    return tuple(float(item) for item in value)


def _whole(data: Mapping[str, object], key: str, count: int) -> tuple[int, ...] | None:
    value = data.get(key)
    if value is None:
        return None
    numbers = _numbers(value, key, count)
    if any(number != int(number) or number < 0 for number in numbers):
        raise ValueError(f"its '{key}' is {value!r}, not {count} whole numbers of pixels")
    return tuple(int(number) for number in numbers)


def _pixel_aspect(data: Mapping[str, object]) -> float | None:
    if data.get("pixel_aspect") is None:
        return None
    (value,) = _numbers([data["pixel_aspect"]], "pixel_aspect", 1)
    if not 0.01 <= value <= 100:
        raise ValueError(f"its 'pixel_aspect' is {value:g}, not in [0.01, 100]")
    return value


def _clip(data: Mapping[str, object]) -> tuple[float, float] | None:
    if data.get("clip") is None:
        return None
    low, high = _numbers(data["clip"], "clip", 2)
    if not low < high:
        raise ValueError(f"its 'clip' is [{low:g}, {high:g}]: the lower code value comes first")
    return low, high


def _silhouette(data: Mapping[str, object]) -> int | None:
    value = data.get("silhouette")
    if value is None:
        return None
    if type(value) is not int or not 0 <= value <= MOST_ERODED:
        raise ValueError(
            f"its 'silhouette' is {value!r}, not a whole number of pixels in [0, {MOST_ERODED}]"
        )
    return value


def _transforms(data: Mapping[str, object]) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """A matrix is a list of 4 rows, or of all 16 numbers; a place may stand alone."""
    value = data.get("transforms")
    if value is None:
        return ()
    if not isinstance(value, dict):
        raise ValueError(f"its 'transforms' are {value!r}, not an object of matrices by lamp")
    found = []
    for name, rows in value.items():
        key = f"transforms['{name}']"
        flat = rows
        if isinstance(rows, list) and len(rows) == 4 and all(isinstance(row, list) for row in rows):
            flat = [number for row in rows for number in _numbers(row, key, 4)]
        nested = isinstance(flat, list) and any(isinstance(item, list) for item in flat)
        if not isinstance(flat, list) or nested or len(flat) not in PLACES:
            raise ValueError(f"its '{key}' is {rows!r}, not 3, 7 or 16 numbers or 4 rows of 4")
        flat = list(_numbers(flat, key, len(flat)))
        if len(flat) == 16 and flat[12:] != [0.0, 0.0, 0.0, 1.0]:
            raise ValueError(f"its '{key}' has the last row {flat[12:]}, not 0, 0, 0, 1")
        if len(flat) == 7 and not any(flat[3:]):
            raise ValueError(f"its '{key}' has the quaternion 0, 0, 0, 0, which is no rotation")
        found.append((name, tuple(flat)))
    return tuple(found)


def _rows(numbers: tuple[float, ...]) -> list[float] | list[list[float]]:
    if len(numbers) != 16:
        return list(numbers)
    return [list(numbers[i : i + 4]) for i in (0, 4, 8, 12)]


def _frame(data: Mapping[str, object]) -> int | None:
    value = data.get("frame")
    if value is None:
        return None
    low, high = FRAMES
    if type(value) is not int or not low <= value <= high:
        raise ValueError(f"its 'frame' is {value!r}, not a whole number from {low} to {high}")
    return value


def _distortion(data: Mapping[str, object]) -> LensDistortion | bool | None:
    value = data.get("distortion")
    if value is None or value is False:
        return value
    names = [item.name for item in fields(LensDistortion)]
    if not isinstance(value, dict) or not {"fx", "fy", "cx", "cy"} <= set(value) <= set(names):
        raise ValueError(
            f"its 'distortion' is {value!r}, not an object with fx, fy, cx, cy "
            "and perhaps k1 to k4, p1 to p4, b2, nor false"
        )
    numbers = {name: _numbers([number], "distortion", 1)[0] for name, number in value.items()}
    if not (numbers["fx"] > 0 and numbers["fy"] > 0):
        raise ValueError("its 'distortion' has a focal length (fx, fy) that is not above 0")
    return LensDistortion(**numbers)
