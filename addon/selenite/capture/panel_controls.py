# SPDX-License-Identifier: GPL-3.0-or-later
"""The controls of a capture in the panel, and how they hold its properties. Identifiers, types and
the numbers of menus are those of .blend files: they must not change."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeAlias

from ..scene_read.lens import LensDistortion
from .value_kinds import BORDER, EXPONENTS, GAMMA, RESPONSES, TOLERANCE

if TYPE_CHECKING:
    import bpy

Row: TypeAlias = "bpy.types.PropertyGroup"
#: What a control shows is as if the property were left out.
LEFT_OUT = object()
#: Parts of the panel, and the group of a row that holds their controls; "" for the row itself.
PARTS = {"row": "", "counts": "how", "taken": "how", "lights": "lights"}
#: Identifier, label and tooltip of a menu's items.
Items = Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Control:
    """A property of a row. kind: "Bool", "Int", "Float", "IntVector", "FloatVector" or "Enum" of
    bpy.props; "Path": of a file; "Lamp", "Collection": a pointer. help: "" for that of the
    capture's property. keywords: of bpy.props. when: values of other controls of the row with which
    it counts and is drawn. greys: it is always drawn."""

    name: str
    kind: str
    label: str
    help: str = ""
    keywords: Mapping[str, object] = field(default_factory=dict)
    when: Mapping[str, tuple[object, ...]] = field(default_factory=dict)
    greys: bool = False

    def counts(self, group: Row) -> bool:
        """Whether the other controls let it."""
        return all(getattr(group, name) in values for name, values in self.when.items())


def menu(name: str, label: str, items: Items) -> Control:
    """One of several items, the first by default."""
    numbered = tuple((*item, number) for number, item in enumerate(items))
    return Control(name, "Enum", label, keywords={"items": numbered})


class Binding(ABC):
    """A property in the controls of a row. part: where in the panel they are, one of PARTS."""

    def __init__(self, part: str, *controls: Control) -> None:
        self.part, self.controls = part, controls

    @abstractmethod
    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """The value, or LEFT_OUT. absolute: from a path of Blender to one of the system."""

    @abstractmethod
    def write(self, group: Row, value: object) -> None:
        """The inverse, of a value that is not left out."""


class Plain(Binding):
    """One control whose value is that of the property, or the default: then it is left out."""

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """Of a menu, the item in small letters."""
        (control,) = self.controls
        value = getattr(group, control.name)
        if not control.counts(group) or value == _default(control):
            return LEFT_OUT
        if control.kind == "Enum":
            return value.lower()
        return absolute(value) if control.kind == "Path" else value

    def write(self, group: Row, value: object) -> None:
        """As `read`."""
        (control,) = self.controls
        setattr(group, control.name, str(value).upper() if control.kind == "Enum" else value)


def _default(control: Control) -> object:
    items = control.keywords.get("items")
    if isinstance(items, tuple):
        return items[0][0]
    return control.keywords.get("default", "" if control.kind == "Path" else False)


class Switched(Binding):
    """A value that a switch before it turns on."""

    def __init__(self, part: str, switch: Control, value: Control) -> None:
        when = {**switch.when, switch.name: (True,)}
        super().__init__(part, switch, replace(value, when=when))

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """A tuple of several numbers."""
        value = self.controls[1]
        if not value.counts(group):
            return LEFT_OUT
        found = getattr(group, value.name)
        return tuple(found) if value.kind.endswith("Vector") else found

    def write(self, group: Row, value: object) -> None:
        """Switches it on."""
        for control, content in zip(self.controls, (True, value), strict=True):
            setattr(group, control.name, content)


class Background(Binding):
    """Of the text "border:0.1" or "R,G,B:0.1"."""

    def __init__(self, part: str) -> None:
        items = (
            ("NONE", "Counts", "Nothing is taken for background"),
            ("BORDER", "From the Border",
             "What joins the photo's border in one colour does not count"),
            ("COLOR", "By Colour", "What has a colour does not count"),
        )  # fmt: skip
        color = {"subtype": "COLOR", "size": 3, "min": 0.0, "max": 1.0}
        tolerance = {"default": TOLERANCE, "min": 0.001, "max": 1.0}
        super().__init__(
            part,
            menu("background", "Background", items),
            Control(
                "background_color", "FloatVector", "Colour", "Of the background", color,
                {"background": ("COLOR",)},
            ),
            Control(
                "tolerance", "Float", "Tolerance",
                "Largest difference of a channel, in sRGB code values from 0 to 1", tolerance,
                {"background": ("BORDER", "COLOR")},
            ),
        )  # fmt: skip

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """With its tolerance."""
        kind, color, tolerance = (getattr(group, control.name) for control in self.controls)
        if kind == "NONE":
            return LEFT_OUT
        name = BORDER if kind == "BORDER" else ",".join(f"{value:.6g}" for value in color)
        return f"{name}:{tolerance:.6g}"

    def write(self, group: Row, value: object) -> None:
        """Of a text that `Background` of background.py takes."""
        name, colon, tolerance = str(value).partition(":")
        kind, color, most = (control.name for control in self.controls)
        setattr(group, kind, "BORDER" if name == BORDER else "COLOR")
        if name != BORDER:
            setattr(group, color, [float(part) for part in name.split(",")])
        setattr(group, most, float(tolerance) if colon else TOLERANCE)


class ResponseMenu(Binding):
    """The name of a response, with an exponent or a file beside it."""

    def __init__(self, part: str) -> None:
        items = (
            ("AUTO", "By File", "Colour profile and format of the file"),
            ("SRGB", "sRGB", "The sRGB curve"),
            ("LINEAR", "Linear", "Code values are proportional to light"),
            ("GAMMA", "Power", "Light is a power of the code value"),
            ("TABLE", "Table", "A CSV of code values and light"),
        )
        exponent = {"default": 2.2, "min": EXPONENTS[0], "max": EXPONENTS[1]}
        super().__init__(
            part,
            menu("response", "Response", items),
            Control(
                "gamma", "Float", "Exponent", "Light is the code value to this power", exponent,
                {"response": ("GAMMA",)},
            ),
            Control(
                "response_path", "Path", "Table", "CSV of code values and light",
                when={"response": ("TABLE",)},
            ),
        )  # fmt: skip

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """A table that is not chosen has a name that no file has."""
        kind, exponent, table = (getattr(group, control.name) for control in self.controls)
        if kind == "GAMMA":
            return f"{GAMMA}{exponent:.6g}"
        if kind == "TABLE":
            return absolute(table) or "no table is chosen"
        return kind.lower()

    def write(self, group: Row, value: object) -> None:
        """As `read`."""
        text = str(value)
        kind, exponent, table = (control.name for control in self.controls)
        if text in RESPONSES:
            setattr(group, kind, text.upper())
        elif text.startswith(GAMMA):
            setattr(group, kind, "GAMMA")
            setattr(group, exponent, float(text.removeprefix(GAMMA)))
        else:
            setattr(group, kind, "TABLE")
            setattr(group, table, text)


#: Of a lens: label, default, tooltip, digits; in their order in the panel.
_LENS: dict[str, tuple[str, float, str, int]] = {
    "fx": ("Focal Length X", 1000.0, "In pixels of the whole photo", 1),
    "fy": ("Focal Length Y", 1000.0, "In pixels of the whole photo", 1),
    "cx": ("Centre X", 960.0, "Principal point in pixels from the left", 1),
    "cy": ("Centre Y", 540.0, "Principal point in pixels from the top", 1),
    "k1": ("K1", 0.0, "Radial", 5),
    "k2": ("K2", 0.0, "Radial", 5),
    "k3": ("K3", 0.0, "Radial", 5),
    "k4": ("K4", 0.0, "Radial", 5),
    "p1": ("P1", 0.0, "Tangential, in Metashape's order", 5),
    "p2": ("P2", 0.0, "Tangential, in Metashape's order", 5),
    "p3": ("P3", 0.0, "Tangential, of the slope's square", 5),
    "p4": ("P4", 0.0, "Tangential, of the slope's fourth power", 5),
    "b2": ("B2", 0.0, "Skew in pixels of the whole photo", 5),
}
#: Tooltip, and help of the option.
UNDISTORTED = "The photo is free of the distortion that an import has kept with its camera"


class LensNumbers(Binding):
    """A lens that distorts, or that the photo is free of it."""

    def __init__(self, part: str) -> None:
        numbers = (
            Control(
                name, "Float", label, text, {"default": default, "precision": digits},
                {"use_distortion": (True,)},
            )
            for name, (label, default, text, digits) in _LENS.items()
        )  # fmt: skip
        super().__init__(
            part,
            Control("use_distortion", "Bool", "Distortion"),
            *numbers,
            Control(
                "undistorted", "Bool", "Undistorted", UNDISTORTED, when={"use_distortion": (False,)}
            ),
        )

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """False: it is free of it."""
        if group.use_distortion:
            return LensDistortion(**{name: getattr(group, name) for name in _LENS})
        return False if group.undistorted else LEFT_OUT

    def write(self, group: Row, value: object) -> None:
        """As `read`."""
        if isinstance(value, LensDistortion):
            group.use_distortion = True
            for name in _LENS:
                setattr(group, name, getattr(value, name))
        else:
            group.undistorted = True


class Lamps(Binding):
    """The lamps that were on. A lamp or collection that is not chosen is a lamp without a name,
    which `light_states` refuses. A row chooses lamps by their objects, which a list of names does
    not give: it is not written."""

    def __init__(self, part: str) -> None:
        items = (
            ("ALL", "All Lamps", "As the scene renders them"),
            ("LAMP", "One Lamp", "All others were off"),
            ("COLLECTION", "Collection", "Lamps that are not in the collection were off"),
            ("NONE", "No Lamp", "The world alone"),
        )
        super().__init__(
            part,
            menu("mode", "Lights", items),
            Control("lamp", "Lamp", "Lamp", "The lamp that was on", when={"mode": ("LAMP",)}),
            Control(
                "collection", "Collection", "Collection", "Its lamps were on",
                when={"mode": ("COLLECTION",)},
            ),
        )  # fmt: skip

    def read(self, group: Row, absolute: Callable[[str], str]) -> object:
        """Names of objects."""
        if group.mode == "LAMP":
            return (group.lamp.name if group.lamp is not None else "",)
        if group.mode == "COLLECTION":
            chosen = group.collection.all_objects if group.collection is not None else None
            return ("",) if chosen is None else tuple(x.name for x in chosen if x.type == "LIGHT")
        return () if group.mode == "NONE" else LEFT_OUT

    def write(self, group: Row, value: object) -> None:
        """Raises TypeError: see above."""
        raise TypeError(f"the lamps {value!r} are names, and a row holds objects")
