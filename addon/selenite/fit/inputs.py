# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run was given, as digests: a run that goes on later is given the same, or refused."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np

from .. import __version__
from ..capture.request import PACKED
from ..paths import why_not_file
from ..problems import Problem
from ..scene_read.values import SceneValues
from .request import RunRequest

SCHEMA = 1
#: What a scene holds that is no part of what is rendered; the refraction is one of the settings.
_LEFT_OUT = ("problems", "warnings", "physical_refraction", "owners", "bodies")


@dataclass(frozen=True)
class Inputs:
    """files: "Photo 'x.png'" -> digest of its bytes. scene: "meshes" -> digest of what was read."""

    files: dict[str, str]
    scene: dict[str, str]
    version: str = __version__

    def as_json(self) -> dict[str, object]:
        """A dict of plain values."""
        return {
            "schema": SCHEMA,
            "selenite": self.version,
            "files": self.files,
            "scene": self.scene,
        }

    @staticmethod
    def from_json(data: object) -> Inputs:
        """The inverse. Raises ValueError."""
        if not isinstance(data, dict) or data.get("schema") != SCHEMA:
            raise ValueError(f"it is not of schema {SCHEMA}")
        parts = [data.get("files"), data.get("scene")]
        if not all(
            isinstance(part, dict) and all(isinstance(item, str) for item in part.values())
            for part in parts
        ):
            raise ValueError("its 'files' or 'scene' hold something else than digests")
        return Inputs(data["files"], data["scene"], str(data.get("selenite", "")))


def inputs_of(values: SceneValues, request: RunRequest, packed: Mapping[str, bytes]) -> Inputs:
    """Digests of all that the request is about; files that cannot be read have none."""
    titles = {
        **{title: name for item in request.captures for title, name in item.files().items()},
        **{
            f"File '{item.grid}'": item.grid
            for item in request.unknowns
            if item.grid and not item.grid.isdecimal()
        },
    }
    found = {title: _of_file(name, packed) for title, name in titles.items()}
    scene = {
        item.name: _digest(getattr(values, item.name))
        for item in fields(SceneValues)
        if item.name not in _LEFT_OUT
    }
    return Inputs({title: digest for title, digest in found.items() if digest}, scene)


def changes(before: Inputs, now: Inputs, scene: str) -> list[Problem]:
    """What is not as it was when the run began. `scene`: its file, for the message."""
    cure = "put back what was there, or start a new run with its run.json"
    problems = [
        Problem(title, "its content has changed since the run began", cure)
        for title, digest in before.files.items()
        if title in now.files and now.files[title] != digest
    ]
    if before.version != now.version:  # which may read another part of a scene
        return problems
    parts = [name for name in before.scene if before.scene[name] != now.scene.get(name)]
    if parts:
        cause = f"its {', '.join(parts)} have changed since the run began"
        problems.append(Problem(f"Scene '{scene}'", cause, cure))
    return problems


def _of_file(name: str, packed: Mapping[str, bytes]) -> str:
    """ "" where there is nothing to read: who reads it says so."""
    if name.startswith(PACKED):
        return hashlib.sha256(packed[name]).hexdigest() if name in packed else ""
    if why_not_file(name):
        return ""
    with Path(name).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _digest(value: object) -> str:
    found = hashlib.sha256()
    for piece in _pieces(value):
        found.update(len(piece).to_bytes(8, "little"))
        found.update(piece)
    return found.hexdigest()


def _pieces(value: object) -> Iterable[bytes | memoryview]:
    """Bytes that tell one value from another, whatever it is made of."""
    if isinstance(value, np.ndarray):
        yield f"{value.dtype.str} {value.shape}".encode()
        yield np.ascontiguousarray(value).reshape(-1).view(np.uint8).data  # it may be large
    elif is_dataclass(value):
        for item in fields(value):
            yield item.name.encode()
            yield from _pieces(getattr(value, item.name))
    elif isinstance(value, Mapping):
        for key in sorted(value, key=str):
            yield str(key).encode(errors="surrogatepass")
            yield from _pieces(value[key])
    elif isinstance(value, (list, tuple)):
        yield str(len(value)).encode()
        for item in value:
            yield from _pieces(item)
    else:
        yield repr(value).encode(errors="surrogatepass")
