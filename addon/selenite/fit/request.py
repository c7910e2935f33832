# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user asks for, as one value that is written to run.json and read back."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path

from .. import __version__
from ..capture.request import CaptureRequest
from ..capture.value_kinds import LARGEST
from ..json_text import read_json
from ..messages import thing
from ..parameters import Values
from ..problems import BadInput, Problem
from ..scene_read.options import ReadingOptions
from .settings import FitSettings
from .staging.request import StageRequest, stages_from_json

SCHEMA = 1


@dataclass(frozen=True)
class UnknownRequest:
    """A parameter to fit; None means the default of the scene or of the parameter table.

    Of a field, `grid`: a file, or the voxels along a grid's longest side, the texels along each
    side of an image; "" for the scene's own. `unseen`, of an image: what becomes of texels that no
    photo sees, "keep" (as they were) or "fill" (from those around them); "" for the usual.
    Of the world's image, `size`: its number of texels, of which those of the nearest grid of twice
    as many columns as rows are taken; `projection` of its file, "equirect" or "mirror_ball".
    """

    owner: str
    parameter: str
    start: Values | None = None
    minimum: float | None = None
    maximum: float | None = None
    learning_rate: float | None = None
    grid: str = ""
    unseen: str = ""
    size: int | None = None
    projection: str = ""


@dataclass(frozen=True)
class RunRequest:
    """One fit. No unknowns: the usual ones of the only material. No captures: the scene's.
    No stages: everything at once. reading: what becomes of materials that cannot be read.
    begins_at: folder of the fit whose values, grids and images the scene has here; "" for none."""

    scene: str
    unknowns: tuple[UnknownRequest, ...] = ()
    captures: tuple[CaptureRequest, ...] = ()
    settings: FitSettings = field(default_factory=FitSettings)
    stages: tuple[StageRequest, ...] = ()
    reading: ReadingOptions = field(default_factory=ReadingOptions)
    begins_at: str = ""

    def as_json(self) -> dict[str, object]:
        """A dict of plain values, schema number included."""
        return {
            "schema": SCHEMA,
            "selenite": __version__,
            "scene": self.scene,
            "unknowns": [asdict(item) for item in self.unknowns],
            "captures": [item.as_json() for item in self.captures],
            "settings": self.settings.as_json(),
            "stages": [item.as_json() for item in self.stages],
            "reading": self.reading.as_json(),
            "begins_at": self.begins_at,
        }

    @staticmethod
    def from_json(data: object) -> RunRequest:
        """The inverse of `as_json`. Raises BadInput."""
        title = "Run file"
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            found = data.get("schema") if isinstance(data, dict) else None
            cause = f"its schema is {found!r}, this version reads {SCHEMA}"
            raise BadInput(Problem(title, cause, "give a run.json of this version"))
        try:
            return RunRequest(
                scene=_text(data, "scene"),
                unknowns=tuple(_unknown(item) for item in _objects(data, "unknowns")),
                captures=tuple(
                    CaptureRequest.from_json(item) for item in _objects(data, "captures")
                ),
                settings=FitSettings.from_json(data.get("settings", {})),
                stages=_stages(data.get("stages"), title),
                reading=ReadingOptions.from_json(data.get("reading", {})),
                begins_at=_text(data, "begins_at", ""),
            )
        except ValueError as error:
            cure = "give a run.json as Selenite wrote it"
            raise BadInput(Problem(title, str(error), cure)) from error


def read_run(path: Path) -> RunRequest:
    """Reads a run.json. Raises BadInput."""
    try:
        data = read_json(path)
    except ValueError as error:
        cause = f"cannot be read ({error})"
        raise BadInput(
            Problem(thing("File", path), cause, "give a run.json of Selenite")
        ) from error
    return RunRequest.from_json(data)


def _stages(items: object, title: str) -> tuple[StageRequest, ...]:
    return stages_from_json({"stages": items}, title) if items else ()


def _objects(data: dict[str, object], key: str) -> list[dict[str, object]]:
    """A list of objects. Raises ValueError."""
    items = data.get(key)
    if not isinstance(items, list) or not all(isinstance(item, dict) for item in items):
        raise ValueError(f"its '{key}' are no list of objects")
    return items


def _text(data: dict[str, object], key: str, default: str | None = None) -> str:
    value = data.get(key, default)
    if not isinstance(value, str) or "\0" in value:
        raise ValueError(f"its '{key}' is {value!r}, not text")
    return value


def _number(data: dict[str, object], key: str) -> float | None:
    value = data.get(key)
    if value is None:
        return None
    if not isinstance(value, (int, float)) or type(value) is bool or not abs(value) <= LARGEST:
        raise ValueError(f"its '{key}' is {value!r}, not a finite number")
    return float(value)


def _whole_number(data: dict[str, object], key: str) -> int | None:
    value = data.get(key)
    if value is not None and type(value) is not int:
        raise ValueError(f"its '{key}' is {value!r}, not a whole number")
    return value


def _unknown(item: dict[str, object]) -> UnknownRequest:
    start = item.get("start")
    if start is not None:
        if not isinstance(start, list) or len(start) not in (1, 3):
            raise ValueError(f"its 'start' is {start!r}, not a list of 1 or 3 numbers")
        numbers = [_number({"start": value}, "start") for value in start]
        if None in numbers:
            raise ValueError(f"its 'start' is {start!r}, not a list of 1 or 3 numbers")
        start = tuple(float(value) for value in numbers if value is not None)
    return UnknownRequest(
        _text(item, "owner"),
        _text(item, "parameter"),
        start,
        _number(item, "minimum"),
        _number(item, "maximum"),
        _number(item, "learning_rate"),
        _text(item, "grid", ""),
        _text(item, "unseen", ""),
        _whole_number(item, "size"),
        _text(item, "projection", ""),
    )
