# SPDX-License-Identifier: GPL-3.0-or-later
"""A fit as its workers know it, of the bytes of `parcel`; without Blender."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from ... import native
from .plain import unpacked

if TYPE_CHECKING:
    from ..._core import Scene, StageWorker

#: Size and samples of the picture by which a worker shows that it computes the same numbers.
_PROOF_SIZE, _PROOF_SPP = 24, 8


def opened(data: bytes, threads: int) -> tuple[StageWorker, str]:
    """Who answers the questions of the fit, and its proof. Raises ValueError, KeyError."""
    found = cast("Mapping[str, list]", unpacked(data))
    core = native.core()
    scenes = [_built(calls, found["vertices"]) for calls in found["scenes"]]
    starts = {(owner, name): value for owner, name, value in found["starts"]}
    scenes[0] = scenes[0].with_values(starts)
    pixel = np.ones((1, 1, 3), np.float32)
    stages = [
        core.Stage(
            item["name"], item["parameters"], item["fields"], scenes[item["scene"]],
            [core.Photo(reference=pixel, **photo) for photo in item["photos"]],
            item["settings"],
        )
        for item in found["stages"]
    ]  # fmt: skip
    unknowns = [core.Unknown(**item) for item in found["unknowns"]]
    first = scenes[found["stages"][0]["scene"]]
    return core.StageWorker(unknowns, stages, threads=threads), proof(first)


def proof(scene: Scene) -> str:
    """Digest of a small picture, rounding included: the same for the same scene, build and kind of
    processor."""
    photo = native.core().Photo(scene.cameras[0], size=(_PROOF_SIZE, _PROOF_SIZE))
    film = native.core().Evaluator(scene, threads=1).picture(photo, _PROOF_SPP)
    return hashlib.sha256(np.ascontiguousarray(film.image).tobytes()).hexdigest()


def _built(
    calls: Sequence[tuple[str, Sequence[object], Mapping[str, object]]],
    vertices: Sequence[tuple[str, np.ndarray]],
) -> Scene:
    builder = native.core().SceneBuilder()
    for name, args, named in calls:
        if not name.startswith(("add_", "set_")):
            raise ValueError(f"'{name}' describes no scene")
        getattr(builder, name)(*args, **named)
    scene = builder.build()
    for name, positions in vertices:
        scene = scene.with_vertices(name, positions)
    return scene
