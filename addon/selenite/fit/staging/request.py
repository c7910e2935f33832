# SPDX-License-Identifier: GPL-3.0-or-later
"""Stages: which parameters a run fits first and which later, each for its own iterations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ... import parameters
from ...capture.request import CaptureRequest
from ...json_text import read_json
from ...messages import thing
from ...problems import BadInput, Problem, listed
from ..field_kinds import IN_PLACE_OF, field_kind, kind_of

SCHEMA = 1
#: Where nothing else is asked for.
USUAL = "usual"
_AT_ONCE, _LIGHT_FIRST = "none", "light-first"
#: What `--stages` and the panel offer by name.
PRESETS = {
    USUAL: "light-first where the world's image, an image and its colour are fitted, else none",
    _AT_ONCE: "everything at once",
    "ior-last": "everything but indices of refraction first, then everything",
    "colours-first": "colours first, then everything",
    _LIGHT_FIRST: "the world's image with one colour first, then images and grids",
}
_KEYS = ("name", "parameters", "iterations", "spp", "height")
#: A preset's stages before the last take this share of the iterations.
_FIRST_SHARE = 0.5
_FEWEST = 5


@dataclass(frozen=True)
class StageRequest:
    """One stage. `parameters` are names as `Body:roughness`; None means the run's setting."""

    name: str
    parameters: tuple[str, ...]
    iterations: int | None = None
    spp: int | None = None
    height: int | None = None

    def as_json(self) -> dict[str, object]:
        """Keys name, parameters, and those of the settings that are given."""
        return {key: value for key, value in asdict(self).items() if value is not None}

    def overrides(self) -> dict[str, int]:
        """The settings that this stage has for itself."""
        given = {"iterations": self.iterations, "spp": self.spp, "height": self.height}
        return {key: value for key, value in given.items() if value is not None}

    def title(self, number: int) -> str:
        """As messages name it; `number` counts from 1."""
        return f"Stage {number} '{self.name}'"


def read_stages(path: Path) -> tuple[StageRequest, ...]:
    """Reads a file of stages. Raises BadInput with one problem for each fault."""
    title = thing("File", path)
    try:
        data = read_json(path)
    except ValueError as error:
        cause, cure = f"cannot be read ({error})", f"give a JSON file or {listed(PRESETS)}"
        raise BadInput(Problem(title, cause, cure)) from error
    return stages_from_json(data, title)


def stages_from_json(data: object, title: str) -> tuple[StageRequest, ...]:
    """{"schema": 1, "stages": [{...}, ...]} -> stages. Raises BadInput with every fault."""
    shape = 'write {"schema": 1, "stages": [{"parameters": ["Body:ior"], "iterations": 20}]}'
    if not isinstance(data, dict) or not isinstance(data.get("stages"), list):
        raise BadInput(Problem(title, "it has no list of stages", shape))
    problems = [
        Problem(f"{title}, key '{key}'", "it is not known", "use schema and stages")
        for key in data
        if key not in ("schema", "stages")
    ]
    if data.get("schema", SCHEMA) != SCHEMA:
        cause = f"its schema is {data['schema']!r}, this version reads {SCHEMA}"
        problems.append(Problem(title, cause, "write a file of this version"))
    if not data["stages"]:
        problems.append(Problem(title, "its list of stages is empty", shape))
    found = [
        _stage(item, number, title, problems) for number, item in enumerate(data["stages"], start=1)
    ]
    if problems:
        raise BadInput(problems)
    return tuple(found)


def _stage(item: object, number: int, title: str, problems: list[Problem]) -> StageRequest:
    place = f"{title}, stage {number}"
    if not isinstance(item, dict):
        problems.append(Problem(place, f"{item!r} is no object", 'write {"parameters": [...]}'))
        return StageRequest("", ())
    for key in item:
        if key not in _KEYS:
            cure = f"use {', '.join(_KEYS)}"
            problems.append(Problem(f"{place}, key '{key}'", "it is not known", cure))
    name = item.get("name", f"stage {number}")
    if not (isinstance(name, str) and name.strip()):
        problems.append(Problem(place, f"its name is {name!r}", "give a word or leave it out"))
        name = ""
    names = item.get("parameters")
    if not (isinstance(names, list) and names and all(isinstance(entry, str) for entry in names)):
        cure = 'write a list of names, as in ["Body:roughness", "Body:ior"]'
        problems.append(Problem(place, f"its parameters are {names!r}", cure))
        names = []
    for entry in sorted({entry for entry in names if names.count(entry) > 1}):
        problems.append(Problem(f"{place}, '{entry}'", "given twice", "give it once"))
    numbers: dict[str, int | None] = {}
    for key in ("iterations", "spp", "height"):
        value = item.get(key)
        if value is not None and type(value) is not int:
            cure = "give a whole number or leave it out"
            problems.append(Problem(f"{place}, key '{key}'", f"it is {value!r}", cure))
            value = None
        numbers[key] = value
    return StageRequest(name.strip(), tuple(names), **numbers)


def stages_by_name(
    text: str,
    names: Sequence[str],
    iterations: int,
    problems: list[Problem],
    captures: Sequence[CaptureRequest] = (),
) -> tuple[StageRequest, ...]:
    """A preset's stages for the unknowns `names`; what is wrong goes to `problems`.

    The last stage has everything and the run's iterations, the one before it half of them. A colour
    whose material has a grid or image of it too is left to the first stage: that starts at it.
    After "light-first" the light stays as it was found. No stages: everything at once. captures:
    "usual" asks for their gains.
    """
    if text == USUAL:
        text = _LIGHT_FIRST if _finds_light_first(names, captures) else _AT_ONCE
    if text == _AT_ONCE:
        return ()
    title, later = f"Stages '{text}'", list(names)
    if text == "ior-last":
        first, label = [name for name in names if not _is_ior(name)], "without IOR"
        one, many = "no index of refraction is fitted", "only indices of refraction are fitted"
        cause = one if first else many
    elif text == "colours-first":
        first, label = [name for name in names if _is_colour(name)], "colours"
        cause = "no colour is fitted" if not first else "only colours are fitted"
    elif text == _LIGHT_FIRST:
        label, first = "light", [name for name in names if _is_light(name) or _is_colour(name)]
        later = [name for name in names if not _is_environment(name)]
        cause = "no image or grid is fitted"
        if len(later) == len(names):
            first, cause = [], "World:environment is not fitted"
        elif not any(_is_of_a_body(name) for name in names):
            first = []
    else:
        cure = f"use one of {listed(PRESETS)}, or the path of a file"
        problems.append(Problem(title, "they are not known", cure))
        return ()
    if not first or len(first) == len(names):
        cure = "fit more parameters, or leave the stages out"
        problems.append(Problem(title, cause, cure))
        return ()
    return first_then_all(label, first, later, iterations)


def first_then_all(
    label: str, first: Sequence[str], names: Sequence[str], iterations: int
) -> tuple[StageRequest, ...]:
    """Two stages: `first`, under the name `label`, with half the iterations, then `names`. Of the
    last one an albedo or a base colour is left out whose material has that grid or image too."""
    few = max(_FEWEST, round(_FIRST_SHARE * iterations))
    pairs = [parameters.split_name(name) for name in names]
    last = [
        name
        for name, (owner, parameter) in zip(names, pairs, strict=True)
        if (owner, IN_PLACE_OF.get(parameter)) not in pairs
    ]
    return (
        StageRequest(label, tuple(first), few),
        StageRequest("everything", tuple(last), iterations),
    )


def _finds_light_first(names: Sequence[str], captures: Sequence[CaptureRequest]) -> bool:
    """Whether bodies' images are fitted with the world's, and nothing that makes a body another
    one. Each image's colour must be fitted too, or be free by the gains of all photos: else the
    light would take what it is off by."""
    pairs = [parameters.split_name(name) for name in names]
    fields = [
        (owner, field_kind(parameter))
        for owner, parameter in pairs
        if kind_of(parameter) is not None
    ]
    images = [(owner, kind) for owner, kind in fields if kind.is_image]
    others = [name for name in names if kind_of(parameters.split_name(name)[1]) is None]
    free = bool(captures) and all(item.gain == "rgb" for item in captures)
    return (
        bool(images)
        and any(kind.is_environment for _, kind in fields)
        and not any(kind.is_grid for _, kind in fields)
        and all(_is_colour(name) or _is_light(name) or _is_roughness(name) for name in others)
        and (free or all((owner, kind.single) in pairs for owner, kind in images))
    )


def _is_environment(name: str) -> bool:
    kind = kind_of(parameters.split_name(name)[1])
    return kind is not None and kind.is_environment


def _is_of_a_body(name: str) -> bool:
    return kind_of(parameters.split_name(name)[1]) is not None and not _is_environment(name)


def _is_light(name: str) -> bool:
    return _is_environment(name) or any(row.effect == "emission" for row in _rows(name))


def _is_roughness(name: str) -> bool:
    return parameters.split_name(name)[1] == "roughness"


def _is_ior(name: str) -> bool:
    parameter = parameters.split_name(name)[1]
    return parameter == "ior" or parameter.endswith("_ior")


def _is_colour(name: str) -> bool:
    """By the parameter table: three numbers without a unit."""
    return any(row.width == 3 and row.unit == "1" for row in _rows(name))


def _rows(name: str) -> list[parameters.Parameter]:
    """Of the parameter table, whatever the owner is."""
    parameter = parameters.split_name(name)[1]
    return [row for (_, found), row in parameters.table().items() if found == parameter]
