# SPDX-License-Identifier: GPL-3.0-or-later
"""Sensors of Metashape's XML: focal length, principal point and distortion.

Source: Metashape User Manual, appendix "Camera models". A frame camera maps (x, y) = (X/Z, Y/Z) by
Brown's model to u = w/2 + cx + x' f + x' b1 + y' b2 and v = h/2 + cy + y' f.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from xml.etree.ElementTree import Element

import numpy as np

from ..reconstruction import Intrinsics
from . import numbers
from .files import Place
from .lenses import intrinsics
from .xml_tree import attribute

ALIGN = "align the photos in Metashape and export the cameras again"
#: What the file of old versions writes instead of f and b1.
OLD_FOCAL = "fx"


@dataclass(frozen=True)
class Sensor:
    """What cameras of a sensor have in common: intrinsics, or why there are none; remarks.
    in_rig: 4 x 4, of such a camera to the master camera of its rig."""

    intrinsics: Intrinsics | None
    cause: str = ""
    remarks: tuple[str, ...] = ()
    in_rig: np.ndarray = field(default_factory=lambda: np.eye(4))


def read_sensor(element: Element, place: Place) -> Sensor:
    """A <sensor>. Raises ReconstructionError."""
    found = _lens(element, place)
    remarks = found.remarks
    if any(_is_rolling(entry) for entry in element.findall("property")):
        remarks += ("it has a rolling shutter: what the camera's motion moves is left out",)
    # Neutral where the file has none, as for the planes of one multispectral camera.
    in_rig = numbers.pose(*turn_and_move(element, "location", place))
    return replace(found, remarks=remarks, in_rig=in_rig)


def _lens(element: Element, place: Place) -> Sensor:
    kind = element.get("type", "frame")
    calibration = _calibration(element)
    if calibration is not None:
        kind = calibration.get("type", kind)
    if kind != "frame":
        return Sensor(None, f"its sensor is of type {kind}, which is no pinhole with a lens")
    size = _resolution(element, calibration, place)
    if calibration is None:
        return _of_properties(element, size, place)
    return _of_calibration(calibration, size, place)


def _is_rolling(entry: Element) -> bool:
    value = entry.get("value", "").strip().lower()
    return entry.get("name") == "rolling_shutter" and value not in ("", "false", "0", "disabled")


def turn_and_move(element: Element, move: str, place: Place) -> tuple[np.ndarray, np.ndarray]:
    """3 x 3 of <rotation>, and (3,) of the child with the name `move`. What is absent, or empty as
    in <rotation fixed="true"/>, is neutral. Raises ReconstructionError."""
    turn, moved = np.eye(3), np.zeros(3)
    if text := (element.findtext("rotation") or "").strip():
        turn = numbers.rotation(text, place.at(f"{place.element}, <rotation>"))
    if text := (element.findtext(move) or "").strip():
        moved = numbers.numbers(text, place.at(f"{place.element}, <{move}>"), 3)
    return turn, moved


def _calibration(element: Element) -> Element | None:
    """The one that was adjusted comes before the one that was given."""
    found = element.findall("calibration")
    adjusted = [one for one in found if one.get("class", "adjusted") == "adjusted"]
    return next(iter(adjusted + found), None)


def _resolution(element: Element, calibration: Element | None, place: Place) -> tuple[int, int]:
    for holder in (calibration, element):
        resolution = None if holder is None else holder.find("resolution")
        if resolution is not None:
            inner = place.at(f"{place.element}, <resolution>")
            return (
                numbers.pixels(numbers.whole(attribute(resolution, "width", inner), inner), inner),
                numbers.pixels(numbers.whole(attribute(resolution, "height", inner), inner), inner),
            )
    raise place.error("it has no <resolution>")


def _of_properties(element: Element, size: tuple[int, int], place: Place) -> Sensor:
    """Without a calibration: focal length and pixel size in millimetres."""
    found: dict[str, float] = {}
    for entry in element.findall("property"):
        name = entry.get("name", "")
        if name in ("focal_length", "pixel_width", "pixel_height"):
            found[name] = numbers.positive(entry.get("value"), place.at(f"{place.element}, {name}"))
    if "focal_length" not in found or "pixel_width" not in found:
        raise place.error("it has neither a <calibration> nor focal_length and pixel_width", ALIGN)
    across = found["focal_length"] / found["pixel_width"]
    down = found["focal_length"] / found.get("pixel_height", found["pixel_width"])
    remark = "it has no calibration: the focal length is that of its lens, without distortion"
    lens = intrinsics(size, {"fx": across, "fy": down}, place)
    return Sensor(lens, remarks=(remark,))


def _of_calibration(calibration: Element, size: tuple[int, int], place: Place) -> Sensor:
    values = _values(calibration, place)
    if "f" not in values:
        if OLD_FOCAL in values:
            raise place.error(
                "its calibration is in the form of PhotoScan 1.2 or before",
                "open the project in Metashape and export the cameras again",
            )
        raise place.error("its <calibration> has no <f>")
    (width, height), focal = size, values["f"]
    in_pixels = {
        "fx": focal + values.get("b1", 0.0), "fy": focal,
        "cx": width / 2 + values.get("cx", 0.0), "cy": height / 2 + values.get("cy", 0.0),
    }  # fmt: skip
    return Sensor(intrinsics(size, values | in_pixels, place))


def _values(calibration: Element, place: Place) -> dict[str, float]:
    names = ("f", "cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4", OLD_FOCAL)
    found = {}
    for entry in calibration:
        if entry.tag in names:
            inner = place.at(f"{place.element}, <{entry.tag}>")
            found[entry.tag] = numbers.number(_plain(entry.text), inner)
    return found


def _plain(text: str | None) -> str | None:
    """Without the name of a type around the number, which scripts leave that print numpy's."""
    if text and text.strip().startswith("np.float64(") and text.strip().endswith(")"):
        return text.strip()[len("np.float64(") : -1]
    return text
