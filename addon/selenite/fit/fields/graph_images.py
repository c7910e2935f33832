# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of nodes of a graph as unknowns: of normals, of factors, of whatever they give."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...paths import file_stems
from ...problems import BadInput, Problem, choice
from ...scene_read.shaders import ShaderImage
from ...scene_read.values import MapValues, SceneValues, TextureValues
from ..field_kinds import NODE_IMAGE, field_kind
from ..request import UnknownRequest
from ..settings import FitSettings
from .base import material_of, rate_of, share_bounds, whole_number
from .images import (
    MOST_TEXELS,
    ImageUnknown,
    fill_of,
    from_file,
    numbers_of,
    stored_colour,
)
from .seen import unseen_of


@dataclass(frozen=True, eq=False)
class GraphImageUnknown(ImageUnknown):
    """`item`: what the graph says of it."""

    item: ShaderImage

    @property
    def channels(self) -> int:
        """Numbers of a texel."""
        return self.item.channels

    @property
    def file_stem(self) -> str:
        """Of its files' names."""
        node = self.item.name.removesuffix(NODE_IMAGE)
        return f"{self.stem}_{file_stems([node])[node]}"

    def in_scene(self, scene: SceneValues) -> SceneValues:
        """The scene with the start in it."""
        materials = []
        for material in scene.materials:
            if material.name == self.owner and material.shader is not None:
                textures = [*material.shader.textures]
                textures[self.item.texture] = self.texture
                material = replace(material, shader=replace(material.shader, textures=textures))
            materials.append(material)
        return replace(scene, materials=materials)


def graph_image_unknown(
    scene: SceneValues, request: UnknownRequest, settings: FitSettings, title: str
) -> GraphImageUnknown:
    """The image that a request asks for, with its start. Raises BadInput."""
    owner = material_of(scene, request, title)
    low, high = share_bounds(request, title)
    rate = rate_of(request, settings, title)
    material = next(item for item in scene.materials if item.name == owner.name)
    images = material.shader.unknown_images() if material.shader is not None else []
    item = next((one for one in images if one.name == request.parameter), None)
    if item is None or material.shader is None:
        cause = f"its nodes have no image '{request.parameter}' on a UV map"
        cure = choice(request.parameter, [one.name for one in images]) if images else "link one"
        raise BadInput(Problem(title, cause, cure))
    texture, of_scene = _start(material.shader.textures[item.texture], item, request, title)
    pixels = np.clip(texture.pixels, np.float32(low), np.float32(high))
    filled = replace(
        request,
        owner=owner.name,
        minimum=low,
        maximum=high,
        learning_rate=rate,
        unseen=unseen_of(request, of_scene, title),
    )
    return GraphImageUnknown(
        owner.name, field_kind(request.parameter), low, high, rate, 1.0, filled,
        file_stems(scene.owners)[owner.name], filled.unseen,
        MapValues(replace(texture, pixels=pixels), item.attribute, item.uv), item,
    )  # fmt: skip


def _start(
    own: TextureValues, item: ShaderImage, request: UnknownRequest, title: str
) -> tuple[TextureValues, bool]:
    """The image at the start, and whether it says something of each texel."""
    fill, texture = fill_of(request, title), own
    if request.grid and not request.grid.isdecimal():
        texture = from_file(request.grid, own, title)
    if item.channels == 1:
        texture = numbers_of(texture)
    if request.grid.isdecimal():
        number = whole_number(request.grid, 0)
        if not 1 <= number <= MOST_TEXELS:
            cause = f"its image has {number} texels along each side"
            raise BadInput(Problem(title, cause, f"give 1 to {MOST_TEXELS}, or a file"))
        stored = texture.pixels.reshape(-1, 3).mean(axis=0)
        if fill is not None:
            stored = stored_colour(fill, texture.encoded)
        pixels = np.broadcast_to(stored, (number, number, 3)).astype(np.float32)
        return replace(texture, pixels=np.ascontiguousarray(pixels)), False
    if fill is not None:
        pixels = np.broadcast_to(stored_colour(fill, texture.encoded), texture.pixels.shape)
        return replace(texture, pixels=np.ascontiguousarray(pixels, np.float32)), False
    return texture, True
