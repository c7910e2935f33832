# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene at what a fit has found, from its result folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..fit import fields as all_fields
from ..fit.checkpoint import RESULT
from ..fit.field_kinds import IN_PLACE_OF, kind_of
from ..fit.request import UnknownRequest
from ..fit.settings import FitSettings
from ..fit.unknowns import choose
from ..parameters import Values, join_name, split_name
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues
from .result_file import CURE, StoredParameter, stored_result


def at_result(
    values: SceneValues, folder: Path
) -> tuple[SceneValues, dict[tuple[str, str], Values]]:
    """The scene with the fitted grids and images, and the fitted constants by owner and parameter.

    folder: holds result.json and the files that it names. Raises BadInput.
    """
    rows = _parameters(folder)
    constants, requests = {}, []
    for name, row in rows.items():
        owner, parameter = split_name(name)
        if kind_of(parameter) is not None:
            file = str(folder / _file_of(name, row, folder))
            requests.append(UnknownRequest(owner, parameter, grid=file))
        elif join_name(owner, IN_PLACE_OF.get(parameter, "")) not in rows:
            constants[owner, parameter] = row.value
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
        name: folder / _file_of(name, row, folder)
        for name, row in _parameters(folder).items()
        if kind_of(split_name(name)[1]) is not None
    }


def _parameters(folder: Path) -> Mapping[str, StoredParameter]:
    """Raises BadInput."""
    return stored_result(folder).parameters


def _file_of(name: str, row: StoredParameter, folder: Path) -> str:
    """Of a grid or an image. Raises BadInput."""
    if not row.files:
        cause = f"it names no file of '{name}'"
        raise BadInput(Problem(f"File '{folder / RESULT}'", cause, CURE))
    return row.files[0]
