# SPDX-License-Identifier: GPL-3.0-or-later
"""Unknowns with a value at every place: voxels of grids, texels of images, vertices of meshes,
directions of the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ... import parameters
from ...messages import thing
from ...problems import BadInput, Problem
from ...scene_read.values import SceneValues
from ..field_kinds import Family, field_kind, kind_of
from ..request import UnknownRequest
from ..settings import FitSettings
from ..unknowns import Unknown
from .base import FieldUnknown, means
from .environment import EnvironmentUnknown, environment_unknown, fitted_environment, own_name
from .graph_images import graph_image_unknown
from .grids import GridUnknown, fitted_grids, grid_unknown, with_grids
from .images import ImageUnknown, image_unknown
from .seen import SurfaceUnknown
from .vertex_colors import VertexColorsUnknown, vertex_colors_unknown
from .vertex_positions import VerticesUnknown, vertices_unknown

__all__ = [
    "EnvironmentUnknown", "FieldUnknown", "GridUnknown", "ImageUnknown", "SurfaceUnknown",
    "VertexColorsUnknown", "VerticesUnknown", "choose", "fitted_environment", "fitted_grids",
    "means", "name_of", "of_body", "remarks", "split", "with_fields", "with_grids",
]  # fmt: skip

#: What makes a field from its request, for the families of which nothing else in the fit counts.
_OF_BODY = {
    Family.IMAGE: image_unknown,
    Family.NODE_IMAGE: graph_image_unknown,
    Family.COLORS: vertex_colors_unknown,
    Family.SHAPE: vertices_unknown,
}


def split(requests: Sequence[UnknownRequest]) -> tuple[list[UnknownRequest], list[UnknownRequest]]:
    """(those with one value, fields)."""
    fields = [item for item in requests if kind_of(item.parameter) is not None]
    return [item for item in requests if kind_of(item.parameter) is None], fields


def name_of(scene: SceneValues, request: UnknownRequest) -> str:
    """What the unknown of a request is called, field or not."""
    kind = kind_of(request.parameter)
    environment = kind is not None and kind.is_environment
    owner = own_name(scene, request.owner) if environment else request.owner
    return parameters.join_name(owner, request.parameter)


def choose(
    scene: SceneValues,
    requests: Sequence[UnknownRequest],
    others: Sequence[Unknown],
    settings: FitSettings,
    problems: list[Problem],
) -> list[FieldUnknown]:
    """Requests -> fields with their start; what is wrong goes to `problems`."""
    found: list[FieldUnknown] = []
    for request in requests:
        title = thing("Parameter", parameters.join_name(request.owner, request.parameter))
        kind = field_kind(request.parameter)
        if kind.is_environment:
            request = replace(request, owner=own_name(scene, request.owner))
        fitted = {item.parameter.name for item in others if item.owner == request.owner}
        if kind.single in fitted:
            cause = f"it takes the place of the one {kind.single}, which is fitted too"
            problems.append(Problem(title, cause, "fit one of them"))
            continue
        try:
            field = _field(scene, request, others, settings, title)
        except BadInput as error:
            problems += error.problems
            continue
        if field.name in {item.name for item in found}:
            problems.append(Problem(title, "given twice", "give it once"))
        found.append(field)
    return found


def _field(
    scene: SceneValues,
    request: UnknownRequest,
    others: Sequence[Unknown],
    settings: FitSettings,
    title: str,
) -> FieldUnknown:
    """Raises BadInput."""
    kind = field_kind(request.parameter)
    if not kind.is_environment and (request.size is not None or request.projection):
        cause = "only the world's image has a number of texels and a projection"
        raise BadInput(Problem(title, cause, "leave them out, or fit World:environment"))
    if kind.is_of_body:
        return of_body(scene, request, settings, title)
    if kind.is_environment:
        return environment_unknown(scene, request, others, settings, title)
    return grid_unknown(scene, request, others, settings, title)


def of_body(
    scene: SceneValues, request: UnknownRequest, settings: FitSettings, title: str
) -> FieldUnknown:
    """An image on a surface, or what belongs to a mesh. Raises BadInput."""
    return _OF_BODY[field_kind(request.parameter).family](scene, request, settings, title)


def remarks(fields: Sequence[FieldUnknown], others: Sequence[Unknown]) -> list[str]:
    """What a user should know of the fields that can be fitted nevertheless."""
    extinctions = {item.owner for item in others if item.parameter.name == "extinction"}
    products = [
        f"Parameter '{item.name}': only its product with {item.owner}:extinction, which is fitted "
        "too, is seen; fit one of them to know each"
        for item in fields
        if item.kind.use == "density" and item.owner in extinctions
    ]
    notes = [
        f"Parameter '{item.name}': {note}"
        for item in fields
        if isinstance(item, EnvironmentUnknown)
        for note in item.notes
    ]
    return products + notes


def with_fields(values: SceneValues, fields: Sequence[FieldUnknown]) -> SceneValues:
    """The scene with the grids and images at which the fields start."""
    for item in fields:
        values = item.in_scene(values)
    return values
