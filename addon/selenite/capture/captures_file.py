# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that --captures names: what was photographed, and how. See docs/guide/captures.md."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

from ..json_text import read_json
from ..paths import MISSING, why_not_file
from ..problems import BadInput, Problem, choice
from .lamp_table import LampTable
from .request import PACKED, CaptureRequest

SCHEMA = 1
_KEYS = ("captures", "schema")


def read_captures_file(path: Path) -> tuple[CaptureRequest, ...]:
    """The captures of a file, whose paths become those from the working folder. Raises BadInput."""
    title = f"Captures '{path}'"
    try:
        data = read_json(path)
    except ValueError as error:
        if why_not_file(path) == MISSING:
            cause, cure = "the file does not exist", "correct the path"
            raise BadInput(Problem(title, cause, cure)) from error
        cure = "give a JSON file with 'schema' and 'captures'"
        raise BadInput(Problem(title, f"cannot be read ({error})", cure)) from error
    if not isinstance(data, dict):
        cure = "give a JSON file with 'schema' and 'captures'"
        raise BadInput(Problem(title, "it holds no object", cure))
    if data.get("schema") != SCHEMA:
        cause = f"its schema is {data.get('schema')!r}, this version reads {SCHEMA}"
        raise BadInput(Problem(title, cause, f"begin it with 'schema': {SCHEMA}"))
    if unknown := [_unknown(title, key) for key in data if key not in _KEYS]:
        raise BadInput(unknown)
    items = data.get("captures")
    if not isinstance(items, list) or not items:
        cause = "its 'captures' are no list with at least one object"
        raise BadInput(Problem(title, cause, "list one object for each photo"))
    found, problems = [], []
    tables: dict[str, LampTable] = {}
    for number, item in enumerate(items, 1):
        try:
            if not isinstance(item, dict):
                raise ValueError(f"it is {item!r}, not an object")  # noqa: TRY301 - joins the others
            item = _with_table(item, path.parent, tables)
            found.append(_from_here(CaptureRequest.from_json(item), path.parent))
        except ValueError as error:
            cure = "correct it; docs/guide/captures.md lists the keys"
            problems.append(Problem(f"{title}, photo {number}", str(error), cure))
    if problems:
        raise BadInput(problems)
    return tuple(found)


def _unknown(title: str, key: str) -> Problem:
    """A key beside the captures. What holds for all of them stands in each, or on the command
    line."""
    if key in {item.name for item in fields(CaptureRequest)}:
        cause = f"its key '{key}' belongs into its captures"
        return Problem(title, cause, "write it into each object of 'captures'")
    return Problem(title, f"its key '{key}' is not known", choice(key, _KEYS))


def _with_table(
    item: dict[str, object], folder: Path, tables: dict[str, LampTable]
) -> dict[str, object]:
    """A capture whose lamps' places come from a table, with the places themselves. Raises
    ValueError."""
    name = item.get("transforms")
    if not isinstance(name, str):
        return item
    if name not in tables:
        tables[name] = LampTable(folder / name)
    photo, identity = (str(item.get(key) or "") for key in ("photo", "id"))
    return item | {"transforms": tables[name].of(identity, photo)}


def _from_here(capture: CaptureRequest, folder: Path) -> CaptureRequest:
    def path(name: str) -> str:
        if not name or name.startswith(PACKED):
            return name
        return str(folder / name)

    return replace(
        capture,
        photo=path(capture.photo),
        mask=path(capture.mask),
        exclude=path(capture.exclude),
        response=path(capture.response_file) or capture.response,
    )
