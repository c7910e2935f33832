# SPDX-License-Identifier: GPL-3.0-or-later
"""What the user asks for, as one value that is written to run.json and read back."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

from .. import __version__
from ..parameters import Values
from ..problems import BadInput, Problem
from ..scene_read.values import CaptureRequest
from .settings import FitSettings
from .staging.request import StageRequest, stages_from_json

SCHEMA = 1


@dataclass(frozen=True)
class UnknownRequest:
    """A parameter to fit; None means the default of the scene or of the parameter table.

    Of a field, `grid`: a file, or the voxels along a grid's longest side, the texels along each
    side of an image; "" for the scene's own. `unseen`, of an image: what becomes of texels that no
    photo sees, "keep" (as they were) or "fill" (from those around them); "" for the usual.
    """

    owner: str
    parameter: str
    start: Values | None = None
    minimum: float | None = None
    maximum: float | None = None
    learning_rate: float | None = None
    grid: str = ""
    unseen: str = ""


@dataclass(frozen=True)
class RunRequest:
    """One fit. No unknowns: the usual ones of the only material. No captures: the scene's.
    No stages: everything at once. staging: why, in a sentence, where the photos chose them; "" for
    those that the user gave."""

    scene: str
    unknowns: tuple[UnknownRequest, ...] = ()
    captures: tuple[CaptureRequest, ...] = ()
    settings: FitSettings = field(default_factory=FitSettings)
    stages: tuple[StageRequest, ...] = ()
    staging: str = ""

    def as_json(self) -> dict[str, Any]:
        """A dict of plain values, schema number included."""
        return {
            "schema": SCHEMA,
            "selenite": __version__,
            "scene": self.scene,
            "unknowns": [asdict(item) for item in self.unknowns],
            "captures": [asdict(item) for item in self.captures],
            "settings": self.settings.as_json(),
            "stages": [item.as_json() for item in self.stages],
            "staging": self.staging,
        }

    @staticmethod
    def from_json(data: dict[str, Any]) -> RunRequest:
        """The inverse of `as_json`. Raises BadInput."""
        title = "Run file"
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            found = data.get("schema") if isinstance(data, dict) else None
            cause = f"its schema is {found!r}, this version reads {SCHEMA}"
            raise BadInput(Problem(title, cause, "give a run.json of this version"))
        try:
            return RunRequest(
                scene=str(data["scene"]),
                unknowns=tuple(_unknown(item) for item in data["unknowns"]),
                captures=tuple(CaptureRequest(**item) for item in data["captures"]),
                settings=FitSettings.from_json(data["settings"]),
                stages=_stages(data.get("stages"), title),
                staging=str(data.get("staging", "")),
            )
        except (KeyError, TypeError, ValueError) as error:
            cause = f"it is incomplete or has a wrong entry ({error})"
            raise BadInput(Problem(title, cause, "give a run.json as Selenite wrote it")) from error


def read_run(path: Path) -> RunRequest:
    """Reads a run.json. Raises BadInput."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        cause = f"cannot be read ({error})"
        raise BadInput(Problem(f"File '{path}'", cause, "give a run.json of Selenite")) from error
    return RunRequest.from_json(data)


def _stages(items: object, title: str) -> tuple[StageRequest, ...]:
    return stages_from_json({"stages": items}, title) if items else ()


def _unknown(item: dict[str, Any]) -> UnknownRequest:
    known = {entry.name for entry in fields(UnknownRequest)}
    start = item.get("start")
    values = {key: value for key, value in item.items() if key in known}
    return UnknownRequest(**values | {"start": None if start is None else tuple(map(float, start))})
