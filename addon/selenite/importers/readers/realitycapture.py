# SPDX-License-Identifier: GPL-3.0-or-later
"""RealityCapture and RealityScan: XMP files beside the photos, or one CSV of all cameras.

Lengths on the photo are shares of its longer side, focal lengths those of a film 36 mm wide.
Coefficients k1 k2 k3 k4 t1 t2 have Metashape's order: x moves by t1 (r² + 2 x²) + 2 t2 x y.
Source: RealityCapture XMP Camera Math (Epic, knowledge base vzwB); RealityScan help, "Registration
export"; the order of t1 and t2 as AliceVision's importSfMData of these files has it.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ..reconstruction import FLIP, ReconstructedCamera, Reconstruction
from . import numbers
from .files import Place, read_text, shortened
from .labels import Labels, LeftOut
from .lenses import intrinsics
from .pictures import Pictures
from .xml_tree import read_tree

FILM = 36.0
MODELS = ("perspective", "brown3", "brown4", "brown3t2", "brown4t2")
COEFFICIENTS = ("k1", "k2", "k3", "k4", "p1", "p2")
ALIGN = "align the photos and export"
OTHER_MODEL = (
    "choose a Distortion model of Brown's (Brown3 or Brown4) in the settings of the alignment, and "
    "export again"
)
NOT_ALIGNED = "it has no pose: RealityCapture did not align it"
MOST_FILES = 100_000
#: Of a CSV with cameras, and the names that versions have for the same.
REQUIRED = ("name", "x", "y", "alt", "heading", "pitch", "roll", "f")
SEPARATORS = (",", ";", "\t")
ALIASES = {"yaw": "heading", "z": "alt", "f_35mm": "f", "px_norm": "px", "py_norm": "py"}


class _Cameras:
    """Those that are read, and why others are not."""

    def __init__(self) -> None:
        self.labels = Labels()
        self.found: list[ReconstructedCamera] = []
        self.skipped = LeftOut()
        self.cure = ALIGN

    def reconstruction(self, name: str, place: Place) -> Reconstruction:
        """Raises ReconstructionError where none is left."""
        if not self.found:
            causes = self.skipped.causes() or "there are none"
            raise place.error(f"no camera can be used ({causes})", self.cure)
        return Reconstruction(name, tuple(self.found), remarks=tuple(self.skipped.remarks()))

    def add(
        self, label: str, pose: np.ndarray, values: Mapping[str, float], size: tuple[int, int],
        photo: str, place: Place,
    ) -> None:  # fmt: skip
        """values: f in mm, u and v in shares, aspect, skew, k1 to k4, p1 and p2."""
        self.labels.add(label, place)
        width, height = size
        longer = max(width, height)
        focal = values["f"] * longer / FILM
        in_pixels = {
            "fx": focal, "fy": focal * values.get("aspect", 1.0),
            "cx": width / 2 + values.get("u", 0.0) * longer,
            "cy": height / 2 + values.get("v", 0.0) * longer,
            "b2": values.get("skew", 0.0) * longer / FILM,
        }  # fmt: skip
        lens = intrinsics(size, {**values, **in_pixels}, place)
        self.found.append(ReconstructedCamera(label, pose, lens, photo=photo))


def is_xmp(root: Element) -> bool:
    """Whether it is such a file."""
    return root.tag == "xmpmeta"


def read_xmp(files: Sequence[Path], name: str, folders: Iterable[Path] = ()) -> Reconstruction:
    """One camera of each file, whose photo has the same name. Raises ReconstructionError."""
    folder = files[0].parent
    if len(files) > MOST_FILES:
        raise Place(folder, "folder").error(f"it has more than {MOST_FILES} XMP files")
    cameras, folders = _Cameras(), tuple(folders)
    near: dict[Path, Pictures] = {}
    for file in sorted(files):
        pictures = near.setdefault(file.parent, Pictures(file.parent, folders))
        _read_xmp(file, cameras, pictures)
    return cameras.reconstruction(name, Place(folder, "XMP"))


def _read_xmp(file: Path, cameras: _Cameras, pictures: Pictures) -> None:
    root, place = read_tree(file), Place(file, "Description")
    if not is_xmp(root):
        raise Place(file, "XML").error("it is no XMP", "give the XMP files of RealityCapture alone")
    fields: dict[str, str] = {}
    for element in root.iter("Description"):
        fields.update((key.rpartition("}")[2], text) for key, text in element.attrib.items())
        fields.update((one.tag, one.text or "") for one in element)
    label = file.stem
    if "Position" not in fields or "Rotation" not in fields:
        cameras.skipped.add(label, NOT_ALIGNED)
        return
    # Coefficients without a model are Brown's, as those of the other models are named.
    usual = "brown4t2" if "DistortionCoeficients" in fields else "perspective"
    model = fields.get("DistortionModel", usual).strip().lower()
    if model not in MODELS:
        cameras.skipped.add(label, f"its model {shortened(model)} is not Brown's")
        cameras.cure = OTHER_MODEL
        return
    rotation = numbers.rotation(fields["Rotation"], place.at("Rotation"))
    centre = numbers.numbers(fields["Position"], place.at("Position"), 3)
    photo = pictures.find(label)
    values = _xmp_values(fields, model, place)
    size = pictures.size([label], place)
    name = label if photo is None else photo.name
    cameras.add(label, numbers.pose(rotation.T, centre), values, size, name, place)


def _xmp_values(fields: Mapping[str, str], model: str, place: Place) -> dict[str, float]:
    names = {
        "FocalLength35mm": "f", "PrincipalPointU": "u", "PrincipalPointV": "v",
        "AspectRatio": "aspect", "Skew": "skew",
    }  # fmt: skip
    found = {
        short: numbers.number(fields[long], place.at(long))
        for long, short in names.items()
        if long in fields
    }
    if "f" not in found:
        raise place.error("it has no FocalLength35mm")
    if model != "perspective":
        inner = place.at("DistortionCoeficients")
        listed = numbers.numbers(fields.get("DistortionCoeficients"), inner)
        if not 3 <= len(listed) <= len(COEFFICIENTS):
            raise inner.error(f"it has {len(listed)} numbers instead of {len(COEFFICIENTS)}")
        found.update(zip(COEFFICIENTS, (float(value) for value in listed), strict=False))
    return found


def csv_header(text: str) -> tuple[dict[str, int], str] | None:
    """Columns by name and what parts them, if it is a table of cameras."""
    line = next((line for line in text[:100_000].splitlines() if _is_header(line)), "")
    for separator in SEPARATORS:
        names = [name.strip("# \t").lower() for name in _cells(line, separator)]
        found = {ALIASES.get(name, name): index for index, name in enumerate(names)}
        if all(name in found for name in REQUIRED):
            return found, separator
    return None


def _cells(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    except csv.Error:
        return []


def _is_header(line: str) -> bool:
    return line.lstrip('# \t"').lower().startswith("name")


def _is_camera(row: list[str]) -> bool:
    """Whether it is neither empty, nor a comment, nor the header."""
    first = row[0].strip() if row else ""
    return bool(first) and not first.startswith("#") and first.lower() != "name"


def read_csv(file: Path, folders: Iterable[Path] = ()) -> Reconstruction:
    """One camera of each row. Raises ReconstructionError."""
    text = read_text(file)
    header = csv_header(text)
    if header is None:
        raise Place(file, "header").error(
            f"its columns are not those of cameras: {', '.join(REQUIRED)}",
            "export internal/external camera parameters",
        )
    columns, separator = header
    cameras, pictures = _Cameras(), Pictures(file.parent, folders)
    try:
        rows = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
        for count, row in enumerate(rows, start=1):
            if _is_camera(row):
                _read_row(row, columns, cameras, pictures, Place(file, f"row {count}"))
    except csv.Error as error:
        raise Place(file, "CSV").error(f"it is no CSV ({error})") from error
    return cameras.reconstruction(file.stem, Place(file, "CSV"))


def _read_row(
    row: list[str], header: Mapping[str, int], cameras: _Cameras, pictures: Pictures, place: Place
) -> None:
    # A column may be there twice: of the header there are then fewer names than columns.
    columns = max(header.values()) + 1
    if len(row) < columns:
        raise place.error(f"it has {len(row)} columns instead of {columns}")
    label = row[header["name"]].strip()
    place = place.at(f"{place.element} '{label}'")
    found = {
        name: numbers.number(row[index], place.at(f"{place.element}, {shortened(name)}"))
        for name, index in header.items()
        if name in (*REQUIRED[1:], "px", "py", "k1", "k2", "k3", "k4", "t1", "t2")
    }
    heading, pitch, roll = (math.radians(found[name]) for name in ("heading", "pitch", "roll"))
    pose = numbers.pose(
        _turn(2, -heading) @ _turn(0, pitch) @ _turn(1, roll) @ FLIP,
        np.array([found["x"], found["y"], found["alt"]]),
    )
    names = {"px": "u", "py": "v", "t1": "p1", "t2": "p2"}
    values = {names.get(name, name): value for name, value in found.items()}
    cameras.add(label, pose, values, pictures.size([label], place), label, place)


def _turn(axis: int, angle: float) -> np.ndarray:
    """3 x 3, counterclockwise about x, y or z."""
    found = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    found[[first, second], [first, second]] = math.cos(angle)
    found[first, second], found[second, first] = -math.sin(angle), math.sin(angle)
    return found
