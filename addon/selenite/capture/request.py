# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked for of a photo, and the JSON of it: run.json and --captures hold the same."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from ..problems import choice
from ..scene_read.lens import LensDistortion
from .capture_property import CaptureProperty, Option, declared, properties_of, required
from .panel_controls import (
    UNDISTORTED,
    Background,
    Control,
    Lamps,
    LensNumbers,
    Plain,
    ResponseMenu,
    Switched,
    menu,
)
from .value_kinds import (
    AUTO_RESPONSE,
    File,
    Flag,
    LampNames,
    LampPlaces,
    Lens,
    Levels,
    MaskFile,
    Number,
    OneOf,
    Pixels,
    Response,
    Text,
    Whole,
)

#: Degrees of freedom of a photo's gain: none, one for all channels, one for each.
GAINS = ("none", "scalar", "rgb")
#: Along a side of a photo, in the panel.
_MOST_PIXELS = 100_000


@dataclass(frozen=True)
class CaptureRequest:
    """A camera, a photo from there, and how it was taken.

    The one declaration of a capture: JSON, options, the panel and the guide follow from it, in this
    order. A default stands for what is not said; None mostly for what the run, the scene or the
    photo's file says.

    id: unique in a run, see `with_ids`. lights: the lamps that were on. world: whether its light
    was on. transforms: where lamps were, in world space, by the object's name: a place (3 numbers),
    a place and a quaternion (w, x, y, z: 7 in all), or object to world row by row (16). frame: of
    the scene, from which lamps take their places. size: (width, height) of the whole photo.
    crop: x0, y0, x1, y1 in its pixels. pixel_aspect: width / height. distortion: None: that of its
    camera, if an import has kept one (CameraLens). clip: code values, 1 at the top of integers.
    """

    camera: str = required(Text(), "Name of a camera of the scene")
    photo: str = required(File(), "File of the photo", "see [Photos](photos.md)")
    mask: str = declared(
        "", MaskFile("black"), "Picture whose black pixels do not count",
        left_out="no mask", more="see [Masks](#masks)",
        option=Option(
            metavar="PHOTO=FILE", of_photo=True,
            more="; PHOTO: the camera's name, or CAMERA#2 for its second",
        ),
        panel=Plain("row", Control("mask_path", "Path", "Mask")),
    )  # fmt: skip
    id: str = declared(
        "", Text(), "Name of the capture in results and messages, unique",
        left_out="the camera's name, then `Front#2` and so on",
    )  # fmt: skip
    exclude: str = declared(
        "", MaskFile("white"), "Picture whose white pixels do not count", left_out="nothing",
        option=Option(metavar="PHOTO=FILE", of_photo=True),
        panel=Plain("counts", Control("exclude_path", "Path", "Exclude")),
    )  # fmt: skip
    silhouette: int | None = declared(
        None, Whole(0, 100), "Only what the camera sees of the fitted objects counts",
        left_out="all counts",
        more="so many pixels are taken off [its rim](#masks)",
        option=Option(metavar="N", more=", N pixels off its rim"),
        panel=Switched(
            "counts",
            Control("use_silhouette", "Bool", "Silhouette"),
            Control(
                "silhouette", "Int", "Eroded",
                "Pixels of the comparison that are taken off its rim", {"default": 1},
            ),
        ),
    )  # fmt: skip
    background: str = declared(
        "", Text(), "What of the photo does not count", left_out="nothing",
        more='`"border"` or a colour, see [Masks](#masks)',
        option=Option(
            metavar="WHAT",
            more=": border (what joins it in one colour) or R,G,B; with a tolerance: border:0.1",
        ),
        panel=Background("counts"),
    )  # fmt: skip
    lights: tuple[str, ...] | None = declared(
        None, LampNames(), "Lamps that were on when the photo was taken", left_out="all",
        more="see [Lights of captures](lights_of_captures.md)",
        panel=Lamps("lights"),
    )  # fmt: skip
    world: bool = declared(
        True, Flag(), "The world's light was on; off: it is black", left_out="on",
        panel=Plain("lights", Control("world", "Bool", "World", keywords={"default": True})),
    )  # fmt: skip
    transforms: tuple[tuple[str, tuple[float, ...]], ...] = declared(
        (), LampPlaces(), "Where lamps stood, or the file of a table", left_out="as in the scene",
        more="see [Places of lamps](lights_of_captures.md#places-of-lamps)",
    )  # fmt: skip
    frame: int | None = declared(
        None, Whole(-1048574, 1048574),
        "Lamps stood where they stand at a frame of the scene; only lamps may move",
        left_out="as they are",
        panel=Switched(
            "lights",
            Control("use_frame", "Bool", "Lamps at Frame"),
            Control(
                "frame", "Int", "Frame",
                "Lamps stood as at this frame, and were off if they do not render there",
                {"default": 1}, greys=True,
            ),
        ),
    )  # fmt: skip
    response: str = declared(
        AUTO_RESPONSE, Response(), "How code values became of light",
        left_out='`"auto"`: from the file', more="see [below](#response)",
        option=Option(metavar="NAME|FILE.csv", more=": auto, srgb, linear, gamma:2.2, or a table"),
        panel=ResponseMenu("taken"),
    )  # fmt: skip
    clip: tuple[float, float] | None = declared(
        None, Levels(), "Only code values between two levels count",
        left_out="[detected](photos.md#clipping)",
        more="1 at the top of integers: `[0.02, 0.98]`",
        panel=Switched(
            "taken",
            Control("use_clip", "Bool", "Clip Levels"),
            Control(
                "clip", "FloatVector", "Lowest and Highest",
                "Code values that count, 1 at the top of integers",
                {"size": 2, "default": (0.01, 0.99), "min": 0.0, "soft_max": 1.0},
            ),
        ),
    )  # fmt: skip
    gain: str = declared(
        "", OneOf(GAINS), "Factor on the render", left_out="that of `--gain`, or none",
        native="free_gain",
        more='the fit finds it: `"scalar"` for exposure, `"rgb"` for white balance too',
        option=Option(more=" that the fit finds for each photo; default: none"),
        panel=Plain("taken", menu("gain", "Gain", (
            ("NONE", "None", "Exposure and white balance are those of the scene"),
            ("SCALAR", "Exposure", "The fit finds one factor for the photo"),
            ("RGB", "Exposure and White Balance", "The fit finds a factor for each channel"),
        ))),
    )  # fmt: skip
    align: bool | None = declared(
        None, Flag(), "The fit finds a shift and roll of the photo within 4 pixels",
        left_out="as `--align` says", more="see [below](#in-the-results)", native="align",
        option=Option(value=True),
        panel=Plain("taken", Control("align", "Bool", "Align")),
    )  # fmt: skip
    hold_out: bool = declared(
        False, Flag(), "The fit does not see this photo; the result says how well it renders it",
        left_out="the fit sees it", more="see [Held-out photos](results.md#held-out-photos)",
        panel=Plain("taken", Control("hold_out", "Bool", "Hold Out")),
    )  # fmt: skip
    size: tuple[int, int] | None = declared(
        None, Pixels(2), "Width and height of the whole photo in pixels",
        left_out="those of the file",
        panel=Switched(
            "taken",
            Control(
                "use_size", "Bool", "Own Size",
                "The photo has another shape than the scene, or is cropped",
            ),
            Control("size", "IntVector", "Whole Photo", keywords={
                "size": 2, "default": (1920, 1080), "min": 1, "max": _MOST_PIXELS,
            }),
        ),
    )  # fmt: skip
    crop: tuple[int, int, int, int] | None = declared(
        None, Pixels(4),
        "What the file holds, in pixels of the whole photo from its top left corner",
        left_out="all", more="x0, y0, x1, y1",
        panel=Switched(
            "taken",
            Control(
                "use_crop", "Bool", "Cropped", "The file holds a part of the photo",
                when={"use_size": (True,)},
            ),
            Control("crop", "IntVector", "Left, Top, Right, Bottom", keywords={
                "size": 4, "default": (0, 0, 1920, 1080), "min": 0, "max": _MOST_PIXELS,
            }),
        ),
    )  # fmt: skip
    pixel_aspect: float | None = declared(
        None, Number(0.01, 100), "Width of the photo's pixels over their height",
        left_out="that of the scene",
        panel=Switched(
            "taken",
            Control(
                "use_pixel_aspect", "Bool", "Own Pixel Aspect",
                "Its pixels have another shape than the scene's",
            ),
            Control("pixel_aspect", "Float", "Width / Height", "Of a pixel", {"default": 1.0}),
        ),
    )  # fmt: skip
    distortion: LensDistortion | bool | None = declared(
        None, Lens(), "The lens distorts the photo",
        left_out="that of an imported camera, else none",
        more="see [below](#distortion); `false`: the photo is free of it",
        option=Option("undistorted", value=False, help=UNDISTORTED),
        panel=LensNumbers("taken"),
    )  # fmt: skip

    def masks(self) -> dict[str, tuple[str, str]]:
        """Files of masks, by what they are called in messages, with what of each does not count."""
        return {
            item.titled(file): (file, item.kind.left_out)
            for item in PROPERTIES
            if isinstance(item.kind, MaskFile) and (file := getattr(self, item.name))
        }

    def of_fit(self) -> dict[str, object]:
        """What a fit finds of the photo, as keywords of core.Photo, which has the same defaults."""
        return {
            item.native: getattr(self, item.name)
            for item in PROPERTIES
            if item.native and not self.leaves_out(item)
        }

    def files(self) -> dict[str, str]:
        """The files that it names, by what they are called in messages."""
        named = ((item, item.kind.file_of(getattr(self, item.name))) for item in PROPERTIES)
        return {item.titled(file): file for item, file in named if file}

    def moved(self, place: Callable[[str], str]) -> CaptureRequest:
        """The same with each file but packed ones as `place` has it."""
        found = {x.name: x.kind.moved(getattr(self, x.name), place) for x in PROPERTIES}
        return CaptureRequest(**found)  # type: ignore[arg-type]

    def leaves_out(self, item: CaptureProperty) -> bool:
        """Whether it does not say a property."""
        return bool(getattr(self, item.name) == item.default)

    def as_json(self) -> dict[str, object]:
        """A dict of plain values, without what is as usual."""
        return {
            item.name: item.kind.written(getattr(self, item.name))
            for item in PROPERTIES
            if not self.leaves_out(item)
        }

    @staticmethod
    def from_json(data: Mapping[str, object]) -> CaptureRequest:
        """The inverse. Raises ValueError, whose text says which key is wrong and what it may be."""
        missing = {item.name: None for item in PROPERTIES if item.is_required}
        return CaptureRequest(**values_from_json({**missing, **data}))  # type: ignore[arg-type]


#: In the order of the panel and the guide.
PROPERTIES = properties_of(CaptureRequest)


def values_from_json(data: Mapping[str, object]) -> dict[str, object]:
    """The values of an object's keys by their properties; null is as if a key were left out. Raises
    ValueError, see `CaptureRequest.from_json`."""
    properties = {item.name: item for item in PROPERTIES}
    for key in data:
        if key not in properties:
            raise ValueError(f"its key '{key}' is not known; {choice(key, sorted(properties))}")
    return {
        key: properties[key].kind.read(key, value)
        for key, value in data.items()
        if value is not None or properties[key].is_required
    }


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
