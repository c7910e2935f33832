# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene at what a fit has found, from its result folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..fit import fields as all_fields
from ..fit.checkpoint import RESULT
from ..fit.field_kinds import IN_PLACE_OF, kind_of
from ..fit.request import UnknownRequest
from ..fit.settings import FitSettings
from ..fit.unknowns import choose
from ..json_text import read_json
from ..parameters import Values, join_name, split_name
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues

_CURE = "give the folder of a fit that has ended"


def at_result(
    values: SceneValues, folder: Path
) -> tuple[SceneValues, dict[tuple[str, str], Values]]:
    """The scene with the fitted grids and images, and the fitted constants by owner and parameter.

    folder: holds result.json and the files that it names. Raises BadInput.
    """
    rows = _rows(folder / RESULT)
    constants, requests = {}, []
    for name, row in rows.items():
        owner, parameter = split_name(name)
        if kind_of(parameter) is not None:
            file = str(folder / _file_of(row, folder))
            requests.append(UnknownRequest(owner, parameter, grid=file))
        elif join_name(owner, IN_PLACE_OF.get(parameter, "")) not in rows:
            constants[owner, parameter] = _numbers(row["value"], folder)
    problems: list[Problem] = []
    settings = FitSettings()
    # A grid is in the scene only where a medium is, which the fit may have made.
    media = [UnknownRequest(*key) for key in constants if key[1] == "extinction"]
    others = choose(values, media, settings, problems, [])
    fields = all_fields.choose(values, requests, others, settings, problems)
    if problems:
        raise BadInput(problems)
    return all_fields.with_fields(values, fields), constants


def field_files(folder: Path) -> dict[str, Path]:
    """Name -> file of each grid and image of a result folder. Raises BadInput."""
    return {
        name: folder / _file_of(row, folder)
        for name, row in _rows(folder / RESULT).items()
        if kind_of(split_name(name)[1]) is not None
    }


def _rows(path: Path) -> dict[str, dict[str, Any]]:
    """The parameters of result.json. Raises BadInput."""
    try:
        rows = read_json(path)["parameters"]
        for name, row in rows.items():
            split_name(name)
            row["value"]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        cause = f"cannot be read ({error})"
        raise BadInput(Problem(f"File '{path}'", cause, _CURE)) from error
    return dict(rows)


def _file_of(row: dict[str, Any], folder: Path) -> str:
    """Of a grid or an image: one of the folder's own. Raises BadInput."""
    files = row.get("files")
    if isinstance(files, list) and files and isinstance(files[0], str):
        name = Path(files[0]).name
        if name == files[0]:
            return name
    raise BadInput(Problem(f"File '{folder / RESULT}'", f"its files are {files!r}", _CURE))


def _numbers(value: object, folder: Path) -> Values:
    """Raises BadInput."""
    items: list[Any] = value if isinstance(value, list) else [value]
    if items and all(type(item) in (int, float) for item in items):
        return tuple(float(item) for item in items)
    raise BadInput(Problem(f"File '{folder / RESULT}'", f"a value is {value!r}", _CURE))
