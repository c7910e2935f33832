# SPDX-License-Identifier: GPL-3.0-or-later
"""Kinds of values that a capture may hold: how each is read from JSON, checked and written."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields

from ..scene_read.lens import LensDistortion

#: A photo that is packed in the .blend: this and the name of its image.
PACKED = "packed:"
#: Responses that have a name; GAMMA is followed by an exponent, all else is a file.
AUTO_RESPONSE, GAMMA = "auto", "gamma:"
RESPONSES = (AUTO_RESPONSE, "srgb", "linear")
#: Of GAMMA.
EXPONENTS = (0.1, 10.0)
#: A background that is not a colour, and the largest difference of a channel from one, in sRGB code
#: values from 0 to 1.
BORDER, TOLERANCE = "border", 0.05
#: Numbers that say where a lamp was: a place, with a quaternion, a matrix.
PLACES = (3, 7, 16)
#: Beyond any number of a request.
LARGEST = 1e300


class Kind(ABC):
    """Any value. parsed_as: the type of what an option of the command line takes."""

    parsed_as: type[str] | type[int] | type[float] = str

    @abstractmethod
    def read(self, key: str, value: object) -> object:
        """From JSON, never null. Raises ValueError, whose text says what is wrong with the key."""

    def written(self, value: object) -> object:
        """The inverse, for JSON."""
        return list(value) if isinstance(value, tuple) else value

    def limits(self) -> dict[str, float]:
        """Lowest and highest number by the names that Blender has for them."""
        return {}

    def file_of(self, value: object) -> str:
        """The file that a value names, "" if it names none."""
        return ""

    def moved(self, value: object, place: Callable[[str], str]) -> object:
        """The value with its file, if it names one, as `place` has it."""
        file = self.file_of(value)
        return place(file) if file and not file.startswith(PACKED) else value


class Text(Kind):
    """Words."""

    def read(self, key: str, value: object) -> str:
        """Without the sign that ends a text in C."""
        if not isinstance(value, str) or "\0" in value:
            raise ValueError(f"its '{key}' is {value!r}, not text")
        return value


class File(Text):
    """The path of a file, or what is packed in the .blend."""

    def file_of(self, value: object) -> str:
        """All of it."""
        return str(value)


@dataclass(frozen=True)
class MaskFile(File):
    """A picture that says which pixels of the photo count. left_out: "black" or "white", what of it
    does not."""

    left_out: str


class Response(File):
    """The name of a response, or the file of one."""

    def file_of(self, value: object) -> str:
        """ "" of a name."""
        text = str(value)
        return "" if text in RESPONSES or text.startswith(GAMMA) else text


@dataclass(frozen=True)
class OneOf(Kind):
    """One of some words; "" for none of them."""

    names: tuple[str, ...]

    def read(self, key: str, value: object) -> str:
        """As it stands."""
        text = Text().read(key, value)
        if text and text not in self.names:
            raise ValueError(f"its '{key}' is {text!r}, not one of {', '.join(self.names)}")
        return text


class Flag(Kind):
    """Yes or no."""

    def read(self, key: str, value: object) -> bool:
        """As it stands."""
        if not isinstance(value, bool):
            raise ValueError(f"its '{key}' is {value!r}, not true or false")
        return value


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number."""

    lowest: int
    highest: int
    parsed_as = int

    def limits(self) -> dict[str, float]:
        """Both."""
        return {"min": self.lowest, "max": self.highest}

    def read(self, key: str, value: object) -> int:
        """As it stands."""
        if type(value) is not int or not self.lowest <= value <= self.highest:
            raise ValueError(
                f"its '{key}' is {value!r}, not a whole number from {self.lowest} to {self.highest}"
            )
        return value


@dataclass(frozen=True)
class Number(Kind):
    """A finite number."""

    lowest: float
    highest: float
    parsed_as = float

    def limits(self) -> dict[str, float]:
        """Both."""
        return {"min": self.lowest, "max": self.highest}

    def read(self, key: str, value: object) -> float:
        """As a float."""
        (number,) = _numbers([value], key, 1)
        if not self.lowest <= number <= self.highest:
            raise ValueError(
                f"its '{key}' is {number:g}, not in [{self.lowest:g}, {self.highest:g}]"
            )
        return number


@dataclass(frozen=True)
class Pixels(Kind):
    """Some whole numbers of pixels."""

    count: int

    def read(self, key: str, value: object) -> tuple[int, ...]:
        """A list of them."""
        numbers = _numbers(value, key, self.count)
        if any(number != int(number) or number < 0 for number in numbers):
            raise ValueError(f"its '{key}' is {value!r}, not {self.count} whole numbers of pixels")
        return tuple(int(number) for number in numbers)


class Levels(Kind):
    """Two code values, the lower one first."""

    def read(self, key: str, value: object) -> tuple[float, float]:
        """A list of them."""
        low, high = _numbers(value, key, 2)
        if not low < high:
            raise ValueError(
                f"its '{key}' is [{low:g}, {high:g}]: the lower code value comes first"
            )
        return low, high


class LampNames(Kind):
    """Some lamps by name."""

    def read(self, key: str, value: object) -> tuple[str, ...]:
        """It may be empty."""
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise ValueError(f"its '{key}' are {value!r}, not a list of names of lamps")
        return tuple(value)


class LampPlaces(Kind):
    """Where lamps were, by name: pairs of a name and one of PLACES numbers."""

    def read(self, key: str, value: object) -> tuple[tuple[str, tuple[float, ...]], ...]:
        """A matrix is a list of 4 rows, or of all 16 numbers; a place may stand alone."""
        if not isinstance(value, dict):
            raise ValueError(f"its '{key}' are {value!r}, not an object of matrices by lamp")
        return tuple((name, _place(f"{key}['{name}']", numbers)) for name, numbers in value.items())

    def written(self, value: object) -> object:
        """Matrices as rows."""
        assert isinstance(value, tuple)  # noqa: S101 - what `read` returns
        return {name: _rows(numbers) for name, numbers in value}


class Lens(Kind):
    """A lens that distorts, or false: the photo is free of it."""

    def read(self, key: str, value: object) -> LensDistortion | bool:
        """What is not given is 0, but for the pinhole."""
        if value is False:
            return False
        names = [item.name for item in fields(LensDistortion)]
        if not isinstance(value, dict) or not {"fx", "fy", "cx", "cy"} <= set(value) <= set(names):
            raise ValueError(
                f"its '{key}' is {value!r}, not an object with fx, fy, cx, cy "
                "and perhaps k1 to k4, p1 to p4, b2, nor false"
            )
        numbers = {name: _numbers([number], key, 1)[0] for name, number in value.items()}
        if not (numbers["fx"] > 0 and numbers["fy"] > 0):
            raise ValueError(f"its '{key}' has a focal length (fx, fy) that is not above 0")
        return LensDistortion(**numbers)

    def written(self, value: object) -> object:
        """An object, or false."""
        return value.as_json() if isinstance(value, LensDistortion) else value


def _numbers(value: object, key: str, count: int) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise ValueError(f"its '{key}' is {value!r}, not a list of {count} numbers")
    for item in value:
        if type(item) not in (int, float) or not abs(item) <= LARGEST:
            raise ValueError(f"its '{key}' holds {item!r}, not a finite number")
    return tuple(float(item) for item in value)


def _place(key: str, rows: object) -> tuple[float, ...]:
    flat = rows
    if isinstance(rows, list) and len(rows) == 4 and all(isinstance(row, list) for row in rows):
        flat = [number for row in rows for number in _numbers(row, key, 4)]
    nested = isinstance(flat, list) and any(isinstance(item, list) for item in flat)
    if not isinstance(flat, list) or nested or len(flat) not in PLACES:
        raise ValueError(f"its '{key}' is {rows!r}, not 3, 7 or 16 numbers or 4 rows of 4")
    numbers = _numbers(flat, key, len(flat))
    if len(numbers) == 16 and numbers[12:] != (0.0, 0.0, 0.0, 1.0):
        last = list(numbers[12:])
        raise ValueError(f"its '{key}' has the last row {last}, not 0, 0, 0, 1")
    if len(numbers) == 7 and not any(numbers[3:]):
        raise ValueError(f"its '{key}' has the quaternion 0, 0, 0, 0, which is no rotation")
    return numbers


def _rows(numbers: tuple[float, ...]) -> list[float] | list[list[float]]:
    if len(numbers) != 16:
        return list(numbers)
    return [list(numbers[i : i + 4]) for i in (0, 4, 8, 12)]
