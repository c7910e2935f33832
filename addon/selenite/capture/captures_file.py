# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that --captures names: what was photographed, and how. See docs/guide/captures.md."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ..atomic_files import write_json
from ..json_text import read_json
from ..paths import MISSING, absolute, why_not_file
from ..problems import BadInput, Problem, choice
from .lamp_table import LampTable
from .request import PROPERTIES, CaptureRequest, values_from_json

SCHEMA = 1
_KEYS = ("captures", "defaults", "schema")
#: What no two captures share.
_OWN = ("id", "photo")
_CURE = "correct it; docs/guide/captures.md lists the keys"


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
    defaults = _defaults(title, data.get("defaults"))
    found, problems = [], []
    tables: dict[str, LampTable] = {}
    for number, item in enumerate(items, 1):
        try:
            if not isinstance(item, dict):
                raise ValueError(f"it is {item!r}, not an object")  # noqa: TRY301 - joins the others
            item = _with_table(defaults | item, path.parent, tables)
            request = CaptureRequest.from_json(item)
            found.append(request.moved(lambda name: str(path.parent / name)))
        except ValueError as error:
            problems.append(Problem(f"{title}, photo {number}", str(error), _CURE))
    if problems:
        raise BadInput(problems)
    return tuple(found)


def write_captures_file(path: Path, captures: Iterable[CaptureRequest]) -> None:
    """The inverse of `read_captures_file`, with whole paths. Raises OSError."""
    rows = [item.moved(lambda name: str(absolute(name))).as_json() for item in captures]
    write_json(path, {"schema": SCHEMA, "captures": rows})


def _defaults(title: str, values: object) -> dict[str, object]:
    """What captures say that do not say it themselves. Raises BadInput."""
    title = f"{title}, defaults"
    if values is None:
        return {}
    if not isinstance(values, dict):
        cause = f"they are {values!r}, not an object"
        raise BadInput(Problem(title, cause, "give an object with keys of a capture"))
    if own := [key for key in _OWN if key in values]:
        cause = f"its key '{own[0]}' differs from capture to capture"
        raise BadInput(Problem(title, cause, "write it into each object of 'captures'"))
    try:
        values_from_json(
            {key: {} if _is_table(key, value) else value for key, value in values.items()}
        )
    except ValueError as error:
        raise BadInput(Problem(title, str(error), _CURE)) from error
    return values


def _is_table(key: str, value: object) -> bool:
    """Whether lamps have their places from the file of a table."""
    return key == "transforms" and isinstance(value, str)


def _unknown(title: str, key: str) -> Problem:
    """A key beside the captures."""
    if key in {item.name for item in PROPERTIES}:
        cause = f"its key '{key}' belongs into its captures"
        return Problem(title, cause, "write it into 'defaults', or each object of 'captures'")
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
