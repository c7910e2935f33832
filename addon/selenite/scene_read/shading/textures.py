# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of a Principled BSDF that vary over the surface: image textures and colour attributes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...messages import remark, thing
from ...parameters import Parameter
from ..baking.wanted import Baker
from ..shaders import STANDARD
from ..texture_values import TextureValues
from ..values import MapValues, greyed
from . import images, nodes
from .coordinates import read_coordinates
from .images import Pixels
from .nodes import Source, Unreadable

# Cycles' own shading system takes Smart for Cubic.
_INTERPOLATIONS = {"Linear": "Linear", "Closest": "Closest", "Cubic": "Cubic", "Smart": "Cubic"}
NODES = {"ShaderNodeTexImage", "ShaderNodeVertexColor", "ShaderNodeAttribute"}
_PROBED = 256  # at most so many texels a side are looked at for a mean


@dataclass
class TextureRoom:
    """Images that were read in one pass over a scene, so that each is read and kept once."""

    pixels: dict[str, Pixels] = field(default_factory=dict)
    textures: dict[tuple[str, bool, bool, str, str], TextureValues] = field(default_factory=dict)
    greys: dict[tuple[TextureValues, str], TextureValues] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    #: Notes what is baked of what cannot be read; None: nothing is.
    baker: Baker | None = None
    #: What stands in for something else, each a sentence; None: nothing does.
    approximations: list[str] | None = None

    def read_map(self, source: Source, title: str) -> MapValues | None:
        """What a linked input looks up, None if the node is neither image nor colour attribute.

        Raises Unreadable when it is one, but set to what is not modelled.
        """
        found = self._looked_up(source, title)
        if found is None:
            return None
        grey = nodes.grey_of(source)
        if grey is None:
            cause = f"{nodes.describe(source.node)} passes {source.conversion}, which cuts it off"
            raise Unreadable(title, cause, "link it through sockets of colours or numbers")
        if grey and found.texture is not None:
            texture = self._grey(found.texture, grey, source, title)
            return replace(found, texture=texture, grey=grey)
        return replace(found, grey=grey)

    def _grey(self, texture: TextureValues, grey: str, source: Source, title: str) -> TextureValues:
        """The texture as a socket of one number leaves it. What is decoded after interpolation is
        made grey after that, so that its texels cannot be."""
        closest = texture.interpolation == "Closest"
        if texture.encoded and not closest:
            cause = f"{nodes.describe(source.node)} passes {source.conversion}, which makes it grey"
            cure = (
                "link it through sockets of colours, set its interpolation to Closest, or its "
                "colour space to Non-Color or Linear Rec.709"
            )
            raise Unreadable(title, cause, cure)
        key = (texture, grey)
        if key not in self.greys:
            colors, alpha = texture.pixels[..., :3], texture.pixels[..., 3:]
            if texture.encoded:
                colors = colors / np.where(alpha != 0, alpha, 1) if alpha.size else colors
                colors, alpha = images.decode(colors), alpha[..., :0]
            pixels = np.concatenate([greyed(colors, grey), alpha], axis=2)
            self.greys[key] = replace(texture, pixels=pixels, encoded=False)
        return self.greys[key]

    def _looked_up(self, source: Source, title: str) -> MapValues | None:
        node, output = source.node, source.socket.identifier
        if isinstance(node, bpy.types.ShaderNodeTexImage):
            return self._image(node, source, title)
        if isinstance(node, bpy.types.ShaderNodeVertexColor) and output == "Color":
            if node.layer_name in STANDARD:
                return None  # computed: Cycles does not find it
            return MapValues(None, node.layer_name)
        if isinstance(node, bpy.types.ShaderNodeAttribute) and output in {"Color", "Vector"}:
            if node.attribute_type != "GEOMETRY" or not node.attribute_name:
                cause = f"{nodes.describe(node)} names no attribute of the geometry"
                raise Unreadable(title, cause, "set its type to Geometry and name an attribute")
            if node.attribute_name in STANDARD:
                return None
            return MapValues(None, node.attribute_name)
        return None

    def _image(self, node: bpy.types.ShaderNodeTexImage, source: Source, title: str) -> MapValues:
        if node.image is None:
            raise Unreadable(title, f"{nodes.describe(node)} has no image", "choose an image")
        if node.projection != "FLAT":
            cause = f"{nodes.describe(node)} is projected as {node.projection.lower()}"
            raise Unreadable(title, cause, "use the projection Flat and a UV map")
        coordinates = read_coordinates(node, source.groups, title)
        texture = self.texture_of(node, title, wants_alpha=source.socket.identifier == "Alpha")
        matrix = coordinates.matrix[:2][:, [0, 1, 3]]
        return MapValues(texture, coordinates.attribute, matrix.astype(np.float32))

    def texture_of(
        self, node: bpy.types.ShaderNodeTexImage, title: str, *, wants_alpha: bool
    ) -> TextureValues:
        """The image of a node, or its alpha as a grey one. Raises Unreadable."""
        if node.image is None:
            raise Unreadable(title, f"{nodes.describe(node)} has no image", "choose an image")
        return self._texture(
            node.image,
            wants_alpha=wants_alpha,
            alpha_linked=any(not link.is_muted for link in node.outputs["Alpha"].links),
            extension=node.extension,
            interpolation=_INTERPOLATIONS[node.interpolation],
        )

    def _texture(
        self,
        image: bpy.types.Image,
        *,
        wants_alpha: bool,
        alpha_linked: bool,
        extension: str,
        interpolation: str,
    ) -> TextureValues:
        name = image.name_full
        if name not in self.pixels:
            self.pixels[name] = images.read_pixels(image)
            if images.is_stale(image):
                self.warnings.append(
                    remark(
                        thing("Image", image.name),
                        "has changes that are not saved: they are rendered here, but Cycles "
                        "reads the file",
                        " ",
                    )
                )
        pixels = self.pixels[name]
        # Where nobody asks for alpha, Cycles leaves the colours multiplied by it. (Outside a
        # clipped image alpha is 0, so that it matters there for opaque ones too.)
        divided = (
            not wants_alpha
            and alpha_linked
            and pixels.associated
            and (extension == "CLIP" or bool((pixels.alpha != 1).any()))
        )
        key = (name, wants_alpha, divided, extension, interpolation)
        if key not in self.textures:
            values = pixels.color
            if wants_alpha:
                values = np.repeat(pixels.alpha[..., None], 3, axis=2)
            elif divided:
                values = np.dstack([pixels.color, pixels.alpha])
            encoded = pixels.encoded and not wants_alpha
            self.textures[key] = TextureValues(name, values, encoded, extension, interpolation)
        return self.textures[key]


class EmptyRoom(TextureRoom):
    """For who only asks how a tree is linked: no image is read."""

    def texture_of(
        self, node: bpy.types.ShaderNodeTexImage, title: str, *, wants_alpha: bool
    ) -> TextureValues:
        """One black texel, whatever the image."""
        return TextureValues("", np.zeros((1, 1, 3), np.float32), False, "REPEAT", "Linear")


def typical_value(parameter: Parameter, found: MapValues) -> tuple[float, ...]:
    """A value of `parameter` that stands for the map where one is needed (to choose lights)."""
    if found.texture is None:
        mean = np.full(3, 0.5)
    else:
        texture = found.texture
        height, width = texture.pixels.shape[:2]
        few = texture.pixels[:: -(-height // _PROBED), :: -(-width // _PROBED), :3]
        plain = Pixels(few, few[..., 0], texture.encoded, False)
        mean = plain.decoded().mean(axis=(0, 1), dtype=np.float64)
    if parameter.width == 1:
        mean = mean.mean(keepdims=True)
    inside = np.clip(mean, parameter.lower, parameter.upper)
    return tuple(float(value) for value in inside)


def excess(parameter: Parameter, found: MapValues) -> str:
    """What of the map is cut off because `parameter` does not reach so far; empty if nothing is."""
    if found.texture is None:
        return ""
    high = float(found.texture.pixels[..., :3].max())
    if high <= max(parameter.upper, 1.0):
        return ""
    return f"values of image '{found.texture.name}' above {parameter.upper:g} are cut off"
