# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows and results of the panel that are fields, grids, images or colours of meshes: where they
start, and how they reach the scene."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import bpy
import numpy as np

from ... import grid_files, parameters, write_back
from ...fit.field_kinds import KINDS, NEW, Family, FieldKind, field_kind, kind_of
from ...fit.fields import FieldUnknown, GridUnknown, of_body
from ...fit.fields.grids import DENSITY_RANGE, USUAL_SIZE
from ...fit.fields.images import USUAL_TEXELS
from ...fit.fields.seen import seen
from ...fit.request import UnknownRequest
from ...fit.settings import FitSettings
from ...messages import thing
from ...problems import BadInput, Problem
from ...report.finished_fit import FinishedFit
from ...report.results import field_text
from ...scene_read.shading import volumes
from ...scene_read.values import GridValues, MaterialValues, Owner, SceneValues
from ...write_back import environments, surfaces
from ...write_back import grids as grid_objects
from .. import texts
from . import environment as environment_rows
from .starts import chosen_file

#: Properties of a row that the user sets, beside those that every row has.
PROPERTIES = (
    "grid_from", "voxels", "texels", "grid_path", "unseen", *environment_rows.PROPERTIES,
)  # fmt: skip


def is_field(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is a grid or an image."""
    return kind_of(row.parameter) is not None


def is_image(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is an image."""
    return is_field(row) and field_kind(row.parameter).is_image


def is_of_body(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is an image or something of a mesh."""
    return is_field(row) and field_kind(row.parameter).is_of_body


def is_grid(row: bpy.types.PropertyGroup) -> bool:
    """Whether a row or a result is a grid."""
    return is_field(row) and field_kind(row.parameter).is_grid


def offered(values: SceneValues, owner: Owner) -> list[str]:
    """The fields that are listed for an owner: grids where it has a medium; the image of a base
    colour that is one or a constant, and of any other parameter that is one; colours where its
    materials show those of its mesh, colours and vertices of the active one; one around the scene
    for the world."""
    if owner.kind == "world":
        return [environment_rows.NAME]
    if owner.kind == "object":
        active = bpy.context.view_layer.objects.active if bpy.context.view_layer else None
        of_mesh = [kind for kind in KINDS.values() if kind.is_of_mesh]
        if active is None or active.name != owner.name:
            shown = _shows_colors(values, owner.name)
            of_mesh = [kind for kind in of_mesh if kind.family is Family.COLORS and shown]
        return [kind.parameter for kind in of_mesh]
    material = _material(values, owner)
    if material is None:
        return []
    block = write_back.datablock(bpy.data.materials, owner)
    # Without nodes there is a colour, but no place for an image.
    has_nodes = block is not None and block.use_nodes
    has_medium = any(owner.values.get("extinction", ()))

    def has_image(kind: FieldKind) -> bool:
        own = material.maps.get(kind.use)
        if own is None:
            return kind.use == "base_color" and kind.use in owner.values
        return own.texture is not None

    return [
        kind.parameter
        for kind in KINDS.values()
        if (kind.is_image and has_nodes and has_image(kind)) or (kind.is_grid and has_medium)
    ]


def _shows_colors(values: SceneValues, name: str) -> bool:
    """Whether a material of an object shows a colour attribute."""
    used = {one for item in values.objects if item.name == name for one in item.materials}
    return any(
        any(found.texture is None for found in item.maps.values())
        or (item.shader is not None and item.shader.attributes("color"))
        for item in values.materials
        if item.name in used
    )


def _start_of(kind: FieldKind, values: SceneValues, name: str) -> str:
    """Where something of a mesh starts: at its own, or a new attribute."""
    return NEW if NEW in kind.starts and not _shows_colors(values, name) else ""


def own_values(values: SceneValues, owner: Owner, parameter: str) -> np.ndarray | None:
    """The grid or image that the scene has, the channels last; None where it has a constant."""
    kind, material = field_kind(parameter), _material(values, owner)
    if material is None:
        return None
    if not kind.is_image:
        grid = material.grids.get(kind.use)
        return grid.values if grid is not None else None
    own = material.maps.get(kind.use)
    return own.texture.pixels if own is not None and own.texture is not None else None


def describe(row: bpy.types.PropertyGroup, values: SceneValues, owner: Owner) -> None:
    """Fills what the list says of a field, and why it cannot be fitted, if it cannot."""
    if environment_rows.is_environment(row):
        environment_rows.describe(row, values, owner)
        return
    kind, own = field_kind(row.parameter), own_values(values, owner, row.parameter)
    row.width, row.unit, row.help = kind.channels, "1", kind.help
    row.value = f"no {'image' if kind.is_image else 'grid'}"
    if kind.is_of_mesh:
        row.value = ""
    if own is not None:
        row.value = " x ".join(map(str, own.shape[-2::-1]))
    row.reason = _why_not(values, owner, row.parameter) if kind.is_of_body else ""


def reset(row: bpy.types.PropertyGroup, values: SceneValues, owner: Owner | None) -> None:
    """A new field, or that of the scene if it has one, with the usual bounds. No owner: it is
    gone."""
    if environment_rows.is_environment(row):
        environment_rows.reset(row, values)
        return
    kind = field_kind(row.parameter)
    own = own_values(values, owner, row.parameter) if owner is not None else None
    colour = owner.values.get(kind.single) if owner is not None else None
    row.grid_from = "new" if own is None else "scene"
    row.voxels, row.texels, row.unseen = USUAL_SIZE, USUAL_TEXELS, "auto"
    (row.minimum, row.maximum), row.start = kind.bounds, (0.8, 0.8, 0.8)
    if kind.rate:
        row.learning_rate = kind.rate
    if kind.is_image and colour is not None:
        row.start = (colour * 3)[:3]
    if kind.use == "density":
        largest = float(own.max()) if own is not None else 0.0
        row.maximum, row.start = DENSITY_RANGE * (largest or 1.0), (1.0, 1.0, 1.0)


def shown(row: bpy.types.PropertyGroup) -> list[str]:
    """The properties of a row that count now."""
    if environment_rows.is_environment(row):
        return environment_rows.shown(row)
    kind = field_kind(row.parameter)
    unseen = ["unseen"] if kind.is_surface else []
    if kind.is_of_mesh:
        return unseen
    size = "texels" if is_image(row) else "voxels"
    place = {"new": [size], "file": ["grid_path"], "scene": []}[row.grid_from]
    return ["grid_from", *place, *unseen]


def requested(
    row: bpy.types.PropertyGroup, values: SceneValues, owner: Owner, title: str
) -> dict[str, object]:
    """What of the row's request is about a field. Raises BadInput."""
    if environment_rows.is_environment(row):
        return environment_rows.requested(row, values, title)
    kind = field_kind(row.parameter)
    unseen = row.unseen if kind.is_surface and row.unseen != "auto" else ""
    if kind.is_of_mesh:
        return {"unseen": unseen, "grid": _start_of(kind, values, owner.name)}
    words = ("image", "picture") if is_image(row) else ("grid", ".npy or .vol file")
    has_own = own_values(values, owner, row.parameter) is not None
    start = chosen_file(row, words, title, has_own=has_own)
    if row.grid_from == "new":
        start = str(row.texels if is_image(row) else row.voxels)
    return {"grid": start, "unseen": unseen}


def keep(
    row: bpy.types.PropertyGroup, field: FieldUnknown, result: FinishedFit, folder: Path
) -> None:
    """Fills one result from the files of the result folder, so that it survives saving."""
    row.parameter, row.width = field.kind.parameter, field.kind.channels
    row.grid_file = str((folder / field.files[0]).absolute())
    row.text = field_text(field, result)
    if isinstance(field, GridUnknown):
        row.grid_to_unit = json.dumps(field.start.to_unit.tolist())
    coverage = result.coverage.get(field.name)
    if coverage is not None:
        row.text += f"\n{100 * seen(coverage).mean():.0f} % seen by the photos"


def fitted_grids(scene: bpy.types.Scene) -> dict[str, dict[str, GridValues]]:
    """The grids of the scene's results, material -> use -> grid. Raises BadInput."""
    found: dict[str, dict[str, GridValues]] = {}
    for row in scene.selenite.results:
        if is_grid(row):
            use = field_kind(row.parameter).use
            grid = GridValues(
                f"{row.owner} {use}",
                grid_files.read(row.grid_file),
                np.array(json.loads(row.grid_to_unit), np.float64),
            )
            found.setdefault(row.owner, {})[use] = grid
    return found


def fitted_surfaces(scene: bpy.types.Scene) -> dict[str, str]:
    """The files of images and colours of meshes of the scene's results, by their names."""
    return {
        parameters.join_name(row.owner, row.parameter): row.grid_file
        for row in scene.selenite.results
        if is_of_body(row)
    }


def replaced(scene: bpy.types.Scene) -> set[tuple[str, str]]:
    """(owner, parameter) of the constants that fields stand for once they are in the scene: media
    are elsewhere then, and base colours are linked."""
    return {
        (row.owner, name)
        for row in scene.selenite.results
        if is_field(row)
        for name in (volumes.PARAMETERS if is_grid(row) else (field_kind(row.parameter).single,))
        if name
    }


def apply(scene: bpy.types.Scene, values: SceneValues, *, with_grids: bool) -> list[str]:
    """Shows the fitted grids by Volume objects, then the fitted images by image nodes and colours
    in meshes, the world's image last; returns what was done. All or none: raises BadInput.

    values: owners and meshes of the scene; values of materials do not count.
    """
    lines: list[str] = []
    undo: list[Callable[[], None]] = []
    grids = fitted_grids(scene) if with_grids else {}
    on_surfaces, world = fitted_surfaces(scene), environment_rows.fitted(scene)
    files = {row.owner: row.grid_file for row in scene.selenite.results if is_grid(row)}
    try:
        for name, uses in grids.items():
            if name not in values.owners:
                cause, cure = "the scene has no such material", "undo its removal or renaming"
                raise BadInput(Problem(thing("Material", name), cause, cure))
            folder = Path(files[name]).parent
            lines.append(grid_objects.show(scene, values, name, uses, folder))
            undo.append(partial(grid_objects.restore, scene, name))
        for name, path in on_surfaces.items():
            lines.append(surfaces.show(values, name, path))
            undo.append(partial(surfaces.restore, name))
        if world:
            lines.append(environments.show(scene, values, world))
    except BadInput:
        for step in reversed(undo):
            step()
        raise
    return lines


def restore(scene: bpy.types.Scene) -> None:
    """The world, the surfaces and then the media as they were before `apply`."""
    if environment_rows.fitted(scene):
        environments.restore(scene)
    for name in fitted_surfaces(scene):
        surfaces.restore(name)
    for name in dict.fromkeys(row.owner for row in scene.selenite.results if is_grid(row)):
        grid_objects.restore(scene, name)


def _material(values: SceneValues, owner: Owner) -> MaterialValues | None:
    if owner.kind != "material":
        return None
    return next((item for item in values.materials if item.name == owner.name), None)


def _why_not(values: SceneValues, owner: Owner, parameter: str) -> str:
    """Why no image and nothing of a mesh can be fitted here, "" if it can: what the fit says of an
    image of one texel, whatever the row starts from."""
    kind = field_kind(parameter)
    if kind.family is Family.NODE_IMAGE:
        return ""
    start = "1" if kind.is_image else _start_of(kind, values, owner.name)
    try:
        of_body(values, UnknownRequest(owner.name, parameter, grid=start), FitSettings(), "")
    except BadInput as error:
        return "; ".join(
            f"{texts.shown(item.cause)}: {texts.shown(item.cure)}" for item in error.problems
        )
    return ""
