# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of `selenite batch`: a table [[fit]] for each fit, [defaults] for what they share.

Keys are the options of `selenite fit` without their hyphens in front; docs/guide/batch.md has
examples. Nothing is declared twice: the options and their types are those of the command.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ...json_text import LARGEST
from ...paths import why_not_file
from ...problems import BadInput, Problem, choice
from ..parser import build_parser

#: What the batch itself gives each fit.
_OWN = ("out", "resume", "json", "help")
_WRITE = "write a table [[fit]] with the keys name and scene for each fit"
#: Of a resumed fit: all else is in its run.json.
_KEPT = ("save", "check-in-cycles", "set-cycles")


@dataclass(frozen=True)
class Entry:
    """One fit. name: of its folder and its row; words: of `selenite fit` from the scene on."""

    name: str
    words: tuple[str, ...]

    @property
    def resumed_words(self) -> tuple[str, ...]:
        """Those of `words` that a run does not keep itself."""
        names = tuple(f"--{name}" for name in _KEPT)
        return tuple(word for word in self.words if word.partition("=")[0] in names)


def read_entries(path: Path) -> list[Entry]:
    """The fits of a file, in its order. Raises BadInput with everything that is wrong in it."""
    title = f"File '{path}'"
    data = _toml(path, title)
    problems: list[Problem] = []
    options = _options()
    defaults = data.pop("defaults", {})
    tables = data.pop("fit", [])
    problems += [Problem(title, f"it has a key '{key}'", _WRITE) for key in data]
    if not isinstance(defaults, dict):
        problems.append(Problem(title, "'defaults' is no table", "write [defaults]"))
        defaults = {}
    if not (isinstance(tables, list) and tables and all(isinstance(t, dict) for t in tables)):
        problems.append(Problem(title, "it has no list of tables 'fit'", _WRITE))
        raise BadInput(problems)
    entries: list[Entry] = []
    for number, table in enumerate(tables, 1):
        given = defaults | table
        name = _name(given, number, {entry.name.casefold() for entry in entries}, problems)
        words = list(_words(f"Fit '{name}'", given, options, problems))
        entries.append(Entry(name, tuple(words)))
    if not problems:
        for entry in entries:
            problems += _refused(entry)
    if problems:
        raise BadInput(problems)
    return entries


def _toml(path: Path, title: str) -> dict[str, object]:
    why = why_not_file(path)
    try:
        if not why and path.stat().st_size > LARGEST:
            why = f"it has more than {LARGEST >> 20} MiB"
        if not why:
            return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        why = (error.strerror or str(error)).lower()
    except UnicodeDecodeError as error:
        why = f"it is not text in UTF-8: {error.reason}"
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        why = f"it is not TOML: {error}"
    raise BadInput(Problem(title, why, "see 'Many fits' in the manual"))


def _options() -> dict[str, argparse.Action]:
    """Of `selenite fit`: option without its hyphens -> how it is read."""
    actions = build_parser()._actions
    fit = next(a for a in actions if isinstance(a, argparse._SubParsersAction)).choices["fit"]
    return {
        option.removeprefix("--"): action
        for option, action in fit._option_string_actions.items()
        if option.startswith("--") and option.removeprefix("--") not in _OWN
    }


def _name(
    given: Mapping[str, object], number: int, taken: set[str], problems: list[Problem]
) -> str:
    """A name that may be one of a folder; without one the stem of the scene's file."""
    scene = given.get("scene")
    name = given.get("name", Path(scene).stem if isinstance(scene, str) else "")
    title = f"Fit {number}"
    if not isinstance(name, str) or not name.strip() or name.startswith("."):
        problems.append(Problem(title, f"its name is {name!r}", "give it a name of letters"))
        return str(number)
    if any(sign in name for sign in '/\\:*?"<>|\0') or len(name) > 100:
        cure = 'leave out / \\ : * ? " < > | and use at most 100 letters'
        problems.append(Problem(title, f"its name '{name}' is none for a folder", cure))
    elif name.casefold() in taken:
        cause = f"another fit has the name '{name}'"
        problems.append(Problem(title, cause, "give each fit a name of its own"))
    return name


def _words(
    title: str,
    given: Mapping[str, object],
    options: Mapping[str, argparse.Action],
    problems: list[Problem],
) -> Iterator[str]:
    """A word for the scene and one or more for each option."""
    if isinstance(given.get("scene"), str):
        yield str(given["scene"])
    else:
        problems.append(Problem(title, "it has no scene", "add scene = 'FILE.blend'"))
    for key, value in given.items():
        option = key.replace("_", "-")
        if key in ("name", "scene"):
            continue
        if option in _OWN:
            problems.append(Problem(title, f"the batch gives '{key}' itself", "take it out"))
        elif option not in options:
            cause = f"'{key}' is no option of selenite fit"
            problems.append(Problem(title, cause, choice(option, options)))
        elif (words := _of_option(option, options[option], value)) is None:
            cause = f"'{key}' cannot be {value!r}"
            problems.append(Problem(title, cause, f"see --{option} in selenite fit --help"))
        else:
            yield from words


def _of_option(option: str, action: argparse.Action, value: object) -> list[str] | None:
    """None: no value for it."""
    is_flag = action.nargs == 0
    if isinstance(value, bool) or is_flag:
        if not (isinstance(value, bool) and is_flag):
            return None
        if value:
            return [f"--{option}"]
        return [f"--no-{option}"] if isinstance(action, argparse.BooleanOptionalAction) else []
    many = isinstance(action, argparse._AppendAction)
    if isinstance(value, dict):
        pairs = [(key, _text(item)) for key, item in value.items()]
        if not many or any(text is None for _, text in pairs):
            return None
        return [f"--{option}={key}={text}" for key, text in pairs]
    if isinstance(value, list) and many:
        texts = [_text(item) for item in value]
        return None if None in texts else [f"--{option}={text}" for text in texts]
    text = _text(value)
    return None if text is None else [f"--{option}={text}"]


def _text(value: object) -> str | None:
    """A number, a text, or a list of them with commas between; None: something else."""
    if isinstance(value, list):
        texts = [_text(item) for item in value if not isinstance(item, list)]
        return ",".join(map(str, texts)) if len(texts) == len(value) and None not in texts else None
    return str(value) if isinstance(value, (str, int, float)) else None


def _refused(entry: Entry) -> list[Problem]:
    """What the command line says of the words."""
    try:
        build_parser().parse_args(["fit", *entry.words])
    except BadInput as error:
        return [
            Problem(
                f"Fit '{entry.name}'",
                f"{item.object[0].lower()}{item.object[1:]}: {item.cause}",
                item.cure,
            )
            for item in error.problems
        ]
    return []
