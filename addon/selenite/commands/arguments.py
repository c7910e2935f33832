# SPDX-License-Identifier: GPL-3.0-or-later
"""Arguments of the form OWNER:PARAMETER=V[,V,V] and the like; what is wrong is a Problem.

A name may stand in double quotes, as a string of JSON: so every name can be written.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from .. import native, parameters
from ..fit.field_kinds import kind_of
from ..fit.settings import number
from ..fit.staging.request import PRESETS, StageRequest, read_stages
from ..parameters import Values
from ..paths import absolute, is_folder, is_there, why_not_file, why_not_folder, why_not_output
from ..problems import BadInput, Problem

Key = tuple[str, str]  # owner, parameter
_EMPTY = "it is empty"
OTHER_FOLDER = "give another folder, or make room and set its rights"

_NAME = json.JSONDecoder(strict=False)  # a line break may stand in a name as it is
_UP_TO_SIGN = re.compile(r"(.+?:\w+)=(.+)", re.DOTALL)
_IN_QUOTES = "put a name with such signs into double quotes, as in"


def _quoted(text: str) -> Key | None:
    """The name in double quotes at the front of `text`, and what follows; None if there are none.

    Raises ValueError.
    """
    if not text.startswith('"'):
        return None
    try:
        name, end = _NAME.raw_decode(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"its name in double quotes cannot be read ({error.msg})") from error
    return name, text[end:]


def unquoted(text: str) -> str:
    """A name that stands in double quotes; any other text as it is."""
    try:
        found = _quoted(text)
    except ValueError:
        return text
    return found[0] if found is not None and not found[1] else text


def _key(text: str) -> Key:
    """Raises ValueError when there is no owner or no parameter."""
    found = _quoted(text)
    if found is None:
        return parameters.split_name(text)
    owner, rest = found
    if not (owner and rest.startswith(":") and rest[1:]):
        raise ValueError(f"'{text}' is not of the form \"OWNER\":PARAMETER")
    return owner, rest[1:]


def names(texts: Sequence[str], problems: list[Problem]) -> list[Key]:
    """["Body:ior,roughness", "World:strength"] -> [("Body", "ior"), ("Body", "roughness"), ...]."""
    keys: list[Key] = []
    for text in texts:
        try:
            owner, rest = _key(text)
        except ValueError as error:
            cure = f"write OWNER:PARAMETER; {_IN_QUOTES} '\"A:b\":ior'"
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
            key = _key(left)
            numbers = tuple(float(part) for part in right.split(","))
            if not all(math.isfinite(number) for number in numbers):
                raise ValueError(f"'{right}' is not finite")
        except ValueError as error:
            cure = (
                f"write OWNER:PARAMETER=V or OWNER:PARAMETER=V,V,V; {_IN_QUOTES} '\"A:b\":ior=1.4'"
            )
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
        title = f"Argument {argument} '{text}'"
        try:
            front = _quoted(text)
            parts = _UP_TO_SIGN.fullmatch(text if front is None else f"N{front[1]}")
            if parts is None:
                raise ValueError(f"it is not OWNER:PARAMETER={form}")
            owner, name = parameters.split_name(parts[1])
        except ValueError as error:
            cure = f"write OWNER:PARAMETER={form}; {_IN_QUOTES} '\"A=1\":PARAMETER={form}'"
            problems.append(Problem(title, str(error), cure))
            continue
        key = (owner if front is None else front[0], name)
        if key in found:
            problems.append(Problem(title, "given twice", "give it once"))
        found[key] = parts[2]
    return found


def grids(texts: Sequence[str], problems: list[Problem]) -> dict[Key, str]:
    """["Body:albedo_grid=16", "Fog:albedo_grid=fog.vol", "Body:vertex_colors=new"] -> number,
    absolute path or "new" by name."""
    found = words(texts, "--grid", "N or =FILE", problems)
    return {
        key: word if word.isdecimal() or word in _starts(key[1]) else str(absolute(word))
        for key, word in found.items()
    }


def _starts(parameter: str) -> tuple[str, ...]:
    kind = kind_of(parameter)
    return kind.starts if kind is not None else ()


def stages(text: str | None, problems: list[Problem]) -> tuple[StageRequest, ...]:
    """The stages of a file; none for a name, or without the argument."""
    if text is None or text in PRESETS:
        return ()
    try:
        return read_stages(absolute(text))
    except BadInput as error:
        problems += error.problems
        return ()


def files(
    texts: Sequence[str], problems: list[Problem], known: Iterable[str] = ()
) -> list[tuple[str, str]]:
    """["Camera=photo.png"] -> [("Camera", absolute path)].

    Of the `known` names the longest that fits counts; otherwise a name ends at the first "=".
    """
    names_first = sorted(known, key=len, reverse=True)
    found = []
    for text in texts:
        cause = "it is not CAMERA=FILE"
        name = path = ""
        try:
            front = _quoted(text)
            if front is not None:
                name, path = front[0], front[1][1:] if front[1].startswith("=") else ""
            else:
                fits = (item for item in names_first if text.startswith(f"{item}="))
                name = next(fits, text.partition("=")[0])
                path = text[len(name) + 1 :]
        except ValueError as error:
            cause = str(error)
        if name and path:
            found.append((name, str(absolute(path))))
        else:
            cure = f"write CAMERA=FILE; {_IN_QUOTES} '\"A=1\"=FILE'"
            problems.append(Problem(f"Argument '{text}'", cause, cure))
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
