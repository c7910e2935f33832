# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments of the form OWNER:PARAMETER=V[,V,V] and the like; what is wrong is a Problem."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from .. import native, parameters
from ..fit_run.settings import number
from ..fit_run.staging.request import AUTO, PRESETS, StageRequest, read_stages
from ..parameters import Values
from ..paths import absolute, is_folder, is_there, why_not_file, why_not_folder, why_not_output
from ..problems import BadInput, Problem

Key = tuple[str, str]  # owner, parameter
_EMPTY = "it is empty"
OTHER_FOLDER = "give another folder, or make room and set its rights"


def names(texts: Sequence[str], problems: list[Problem]) -> list[Key]:
    """["Body:ior,roughness", "World:strength"] -> [("Body", "ior"), ("Body", "roughness"), ...]."""
    keys: list[Key] = []
    for text in texts:
        try:
            owner, rest = parameters.split_name(text)
        except ValueError as error:
            cure = "write OWNER:PARAMETER"
            problems.append(Problem(f"Argument '{text}'", str(error), cure))
            continue
        named = [(owner, name.strip()) for name in rest.split(",") if name.strip()]
        if not named:
            cause, cure = "it names no parameter", "write OWNER:PARAMETER"
            problems.append(Problem(f"Argument '{text}'", cause, cure))
        keys += named
    return list(dict.fromkeys(keys))


def assignments(texts: Sequence[str], problems: list[Problem]) -> dict[Key, Values]:
    """["Body:ior=1.4"] -> {("Body", "ior"): (1.4,)}."""
    found: dict[Key, Values] = {}
    for text in texts:
        left, equals, right = text.rpartition("=")
        try:
            if not equals:
                raise ValueError(f"'{text}' has no '='")
            key = parameters.split_name(left)
            numbers = tuple(float(part) for part in right.split(","))
            if not all(math.isfinite(number) for number in numbers):
                raise ValueError(f"'{right}' is not finite")
        except ValueError as error:
            cure = "write OWNER:PARAMETER=V or OWNER:PARAMETER=V,V,V"
            problems.append(Problem(f"Argument '{text}'", str(error), cure))
            continue
        if key in found:
            problems.append(Problem(f"Argument '{text}'", "given twice", "give it once"))
        found[key] = numbers
    return found


def words(
    texts: Sequence[str], argument: str, form: str, problems: list[Problem]
) -> dict[Key, str]:
    """["Body:base_color_texture=fill"] -> what stands behind the sign, by name; `form`: of that."""
    found: dict[Key, str] = {}
    for text in texts:
        left, equals, right = text.partition("=")
        title = f"Argument {argument} '{text}'"
        try:
            if not (equals and right):
                raise ValueError(f"it is not OWNER:PARAMETER={form}")
            key = parameters.split_name(left)
        except ValueError as error:
            problems.append(Problem(title, str(error), f"write OWNER:PARAMETER={form}"))
            continue
        if key in found:
            problems.append(Problem(title, "given twice", "give it once"))
        found[key] = right
    return found


def grids(texts: Sequence[str], problems: list[Problem]) -> dict[Key, str]:
    """["Body:albedo_grid=16", "Fog:albedo_grid=fog.vol"] -> number or absolute path by name."""
    return {
        key: word if word.isdecimal() else str(absolute(word))
        for key, word in words(texts, "--grid", "N or =FILE", problems).items()
    }


def stages(text: str | None, problems: list[Problem]) -> tuple[StageRequest, ...]:
    """The stages of a file; none for a name, or without the argument."""
    if text is None or text in (*PRESETS, AUTO):
        return ()
    try:
        return read_stages(absolute(text))
    except BadInput as error:
        problems += error.problems
        return ()


def files(texts: Sequence[str], problems: list[Problem]) -> list[tuple[str, str]]:
    """["Camera=photo.png"] -> [("Camera", absolute path)]."""
    found = []
    for text in texts:
        name, equals, path = text.partition("=")
        if name and equals and path:
            found.append((name, str(absolute(path))))
        else:
            cure = "write CAMERA=FILE"
            problems.append(Problem(f"Argument '{text}'", "it is not CAMERA=FILE", cure))
    return found


def input_file(text: str, problems: list[Problem], cure: str) -> Path:
    """A file to be read; `cure`: which one to give."""
    path = absolute(text)
    if why := why_not_file(path) if text else _EMPTY:
        cause = why if why.startswith("it ") else f"cannot be read ({why})"
        problems.append(Problem(f"File '{text}'", cause, cure))
    return path


def output_file(text: str, suffixes: Sequence[str], problems: list[Problem]) -> Path:
    """A file to be written; its folder must exist."""
    path = absolute(text)
    if path.suffix.lower() not in suffixes:
        cause = f"its ending '{path.suffix}' is not known"
        problems.append(Problem(f"File '{text}'", cause, f"end it in {' or '.join(suffixes)}"))
    if why := why_not_output(path) if text else _EMPTY:
        cure = "give a file in an existing folder that can be written"
        problems.append(Problem(f"File '{text}'", why, cure))
    return path


def optional_file(
    text: str | None, suffixes: Sequence[str], problems: list[Problem]
) -> Path | None:
    """The same of an option that may be left out."""
    return None if text is None else output_file(text, suffixes, problems)


def output_folder(text: str, problems: list[Problem], needed: int = 0) -> Path:
    """A folder that may have to be made. needed: bytes that will be written into it."""
    path = absolute(text)
    if is_there(path) and not is_folder(path):
        problems.append(Problem(f"Folder '{text}'", "it is a file", "give the name of a folder"))
    elif why := why_not_folder(path, needed) if text else _EMPTY:
        problems.append(Problem(f"Folder '{text}'", why, OTHER_FOLDER))
    return path


def render_numbers(args: argparse.Namespace, problems: list[Problem]) -> None:
    """--spp, --depth, --threads and --seed of a render, by the native module's ranges."""
    ranges = native.core().setting_ranges()["render"] | {"seed": (0, 2**64 - 1)}
    for name in ("spp", "depth", "threads", "seed"):
        low, high = ranges[name]
        value = getattr(args, name)
        if not low <= value <= high:
            cause = f"{value} lies outside [{number(low)}, {number(high)}]"
            problems.append(Problem(f"Argument --{name}", cause, "give a value inside"))


def stop_if(problems: list[Problem]) -> None:
    """Raises BadInput if there are problems."""
    if problems:
        raise BadInput(problems)
