# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes outputs of nodes in a copy of the file, which is changed and thrown away.

The work of another process: see `baked` for who starts it, and `wanted` for what it asks for.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...atomic_files import take_place
from ...problems import Problem
from ..blend_file import open_blend
from ..camera import named_cameras
from ..geometry.mesh import read_mesh
from ..reading.render_depsgraph import GraphRead, Reading, at_once
from ..reading.without_words import without_words
from ..values import SceneValues
from . import sheet, trees

if TYPE_CHECKING:
    from .request import BakeReport, BakeRequest, MaterialRequest

Note = Callable[[float, str], None]
Key = tuple[str, str]  # name and library of a datablock

_SAMPLES, _NOISY_SAMPLES = 16, 256
#: Pixels around what is baked that continue it.
MARGIN = 8
#: In a picture before it is baked: what still has it is covered by nothing.
_EMPTY = np.float32(-1e30)


def run(_folder: Path, request: BakeRequest, note: Note) -> dict[str, object]:
    """Leaves a folder for each material in the request's folder. Who asked removes `partial`, which
    is on the same disk and holds the one that is not whole."""
    note(0.0, "reading the scene")
    open_blend(str(_folder / "scene.blend"), scripts=request["scripts"])
    scene = bpy.data.scenes[request["scene"]]
    if bpy.context.window is not None:
        bpy.context.window.scene = scene
    wanted = request["materials"]
    names = {(item["name"], item["library"]) for one in wanted for item in one["objects"]}
    meshes = _evaluated(scene, names)
    steps = sum(len(one["objects"]) * (len(one["outputs"]) * 2 + 1) for one in wanted)
    done = 0

    def step() -> None:
        nonlocal done
        note(done / max(steps, 1), f"baking {done + 1} of {steps}")
        done += 1

    for one in wanted:
        target = Path(request["folder"]) / one["key"]
        partial = Path(request["partial"]) / one["key"]
        partial.mkdir(parents=True)
        report = _material(scene, one, meshes, partial, step)
        (partial / "report.json").write_text(json.dumps(report), encoding="utf-8")
        shutil.rmtree(target, ignore_errors=True)
        take_place(partial, target)
    return {}


def _evaluated(scene: bpy.types.Scene, names: set[Key]) -> dict[Key, bpy.types.Mesh]:
    """Meshes of objects as they render, their modifiers applied. What a deformation moves keeps its
    Generated coordinates as an attribute."""
    found: dict[Key, bpy.types.Mesh] = {}

    def read(depsgraph: bpy.types.Depsgraph, _check: Callable[[], None]) -> None:
        for instance in depsgraph.object_instances:
            item = instance.object
            key = _key(item.original)
            if key in names and key not in found and item.type == "MESH":
                found[key] = bpy.data.meshes.new_from_object(
                    item, preserve_all_data_layers=True, depsgraph=depsgraph
                )
                trees.keep_generated(item.data, found[key])

    problem = at_once(_reading(scene, read))
    if problem is not None:
        raise RuntimeError(problem.line())
    return found


def _reading(
    scene: bpy.types.Scene, read: Callable[[bpy.types.Depsgraph, Callable[[], None]], None]
) -> Reading[Problem | None]:
    problem = yield GraphRead(scene, list(named_cameras(scene).values()), read)
    return problem


def _key(block: bpy.types.ID) -> Key:
    return block.name, block.library.filepath if block.library is not None else ""


def _material(
    scene: bpy.types.Scene,
    one: MaterialRequest,
    meshes: dict[Key, bpy.types.Mesh],
    folder: Path,
    step: Callable[[], None],
) -> BakeReport:
    """Writes maps and pictures of all objects; returns what is to be said."""
    material = bpy.data.materials[(one["datablock"], one["library"] or None)]
    size, tiles = one["size"], one["tiles"]
    pictures = [np.full((size, size, 3), _EMPTY, np.float32) for _ in one["outputs"]]
    sums = np.zeros((len(one["outputs"]), 3))  # of differences, of values, of points
    for number, asked in enumerate(one["objects"]):
        item = bpy.data.objects[(asked["name"], asked["library"] or None)]
        mesh = meshes[asked["name"], asked["library"]]
        others = one["sees_others"]
        stage = sheet.Stage(scene, item, mesh, asked["slots"], alone=not others)
        step()
        stage.unwrap(number % tiles, number // tiles, tiles, MARGIN / size)
        triangles = read_mesh(item, lambda: None, SceneValues())
        assert triangles is not None  # noqa: S101 - who asks has read its triangles
        np.save(folder / f"map-{number}.npy", dict(triangles.uv_maps)[sheet.UV_NAME])
        for at, output in enumerate(one["outputs"]):
            with trees.emitting(material, output) as made:
                samples = _NOISY_SAMPLES if output["noisy"] else _SAMPLES
                step()
                with without_words():
                    found = stage.bake(made, size, samples, MARGIN, _EMPTY)
                step()
                with without_words():
                    offset = stage.bake(made, size, samples, 0, _EMPTY, shift=0.5 / size)
            covered = found[..., 0] != _EMPTY
            pictures[at][covered] = found[covered]
            sums[at] += _difference(found, offset)
    for at, pixels in enumerate(pictures):
        pixels[pixels == _EMPTY] = 0
        np.save(folder / f"output-{at}.npy", np.ascontiguousarray(pixels[::-1]))
    return {
        "size": size,
        "errors": [float(a / b) if b > 0 else 0.0 for a, b, _ in sums],
        "points": [int(count) for _, _, count in sums],
    }


def _difference(found: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """(sum of differences, sum of values, number) at the corners of the pixels: what Cycles has
    there against what is looked up there, the mean of four pixels."""
    four = [np.roll(found, (a, b), (0, 1)) for a in (0, 1) for b in (0, 1)]
    counts = (offset[..., 0] != _EMPTY) & np.all([item[..., 0] != _EMPTY for item in four], axis=0)
    looked_up = np.mean([item[counts] for item in four], axis=0, dtype=np.float64)
    true = offset[counts].astype(np.float64)
    return np.array([np.abs(looked_up - true).sum(), np.abs(true).sum(), counts.sum()])
