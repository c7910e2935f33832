# SPDX-License-Identifier: GPL-3.0-or-later
"""`--start RESULT`: a fit begins where another one has ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ...fit.checkpoint import RESULT
from ...fit.field_kinds import field_kind
from ...fit.request import UnknownRequest
from ...parameters import split_name
from ...paths import absolute, is_folder
from ...problems import BadInput, Problem
from ...report.fitted_scene import at_result, field_files
from ...scene_read.values import SceneValues
from ..terminal import say

if TYPE_CHECKING:
    from ...scene_read.hosts import BpyStruct


def start_folder(texts: list[str], problems: list[Problem]) -> tuple[str, list[str]]:
    """The folder of a fit among the words of --start, "" without one, and the other words."""
    folders = [text for text in texts if "=" not in text or is_folder(absolute(text))]
    for text in folders:
        if not (absolute(text) / RESULT).is_file():
            cause, cure = "it holds no result.json", "give the folder of a fit, or OWNER:PARAM=V"
            problems.append(Problem(f"Argument --start {text}", cause, cure))
    if len(folders) > 1:
        cause, cure = f"it names {len(folders)} fits", "give one folder"
        problems.append(Problem("Argument --start", cause, cure))
    named = str(absolute(folders[0])) if folders else ""
    return named, [text for text in texts if text not in folders]


def begin_at(scene: BpyStruct, values: SceneValues, folder: Path) -> SceneValues:
    """Puts what the fit has found into the open scene, which is not saved, as --save would: values,
    images, grids, the world's image. Returns the scene as it is now. Raises BadInput."""
    from ... import write_back
    from ...scene_read.scene import read_scene
    from ...write_back import environments, surfaces
    from ...write_back import grids as grid_objects

    found, constants = at_result(values, folder)
    files = field_files(folder)
    write_back.write(scene, values.owners, constants)
    shows: list[Callable[[], str]] = []
    with_grids = set()
    for name, file in files.items():
        owner, parameter = split_name(name)
        if field_kind(parameter).is_of_body:
            shows.append(partial(surfaces.show, values, name, str(file)))
        elif field_kind(parameter).is_environment:
            shows.append(partial(environments.show, scene, values, str(file), is_final=False))
        else:
            with_grids.add(owner)
    if with_grids and (missing := grid_objects.why_not()):
        say(f"warning: grids of {folder} start the fitted ones alone: {missing}")
        with_grids = set()
    for item in found.materials:
        if item.name in with_grids:
            shows.append(partial(grid_objects.show, scene, values, item.name, item.grids, folder))
    for show in shows:
        show()
    say(f"begins at {folder}")
    return read_scene(scene, note=say)


def starting_there(
    unknowns: tuple[UnknownRequest, ...], folder: Path
) -> tuple[UnknownRequest, ...]:
    """The requests with the grids of a result folder as their start, where none is given."""
    files = field_files(folder)
    return tuple(
        replace(item, grid=str(files[name]))
        if not item.grid
        and (name := f"{item.owner}:{item.parameter}") in files
        and field_kind(item.parameter).is_grid
        else item
        for item in unknowns
    )


def checked(folder: str) -> Path:
    """Of a run.json: the folder must still be there. Raises BadInput."""
    path = Path(folder)
    if not (path / RESULT).is_file():
        cause, cure = "the fit that this one began at is gone", "restore the folder"
        raise BadInput(Problem(f"Folder '{folder}'", cause, cure))
    return path
