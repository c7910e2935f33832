# SPDX-License-Identifier: GPL-3.0-or-later
"""Images and materials of what is imported."""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import bpy
import numpy as np

from .. import native
from ..capture.photo_files import unreadable
from ..problems import BadInput, Problem
from .reconstruction import WHITE, MeshMaterial, PackedPicture, ReconstructedMesh

#: The colour attribute of imported meshes.
COLORS = "Color"
_SPECULAR = ("Specular IOR Level", "Specular")  # 4.0 on, before


class Images:
    """Image datablocks by path; one that the file has already is used, not changed."""

    def __init__(self, made: list[bpy.types.ID]) -> None:
        self._made = made
        self._known = set(bpy.data.images)
        self._packed: dict[PackedPicture, bpy.types.Image] = {}

    def pack(self, picture: PackedPicture) -> bpy.types.Image:
        """As a part of the .blend. Raises BadInput."""
        if picture not in self._packed:
            image = bpy.data.images.new(picture.name, 1, 1)
            self._made.append(image)
            image.pack(data=picture.data, data_len=len(picture.data))
            image.source = "FILE"
            if not image.size[0]:
                title, cause = f"Picture '{picture.name}' of the mesh", "Blender cannot read it"
                raise BadInput(Problem(title, cause, "export the mesh with a PNG or JPEG"))
            self._packed[picture] = image
        return self._packed[picture]

    def load(self, path: Path) -> bpy.types.Image:
        """Raises BadInput."""
        title, cure = f"Picture '{path}'", "give a picture that Blender can read"
        try:
            image = bpy.data.images.load(str(path), check_existing=True)
        except RuntimeError as error:
            cause = str(error).removeprefix("Error: ").strip()
            raise BadInput(Problem(title, f"cannot be read ({cause})", cure)) from error
        if image not in self._known:
            self._known.add(image)
            self._made.append(image)
        return image


class Materials:
    """A material for each of a mesh's, named as the mesh where it has no other, or else as in the
    file; meshes that name the same one share it."""

    def __init__(
        self, meshes: Sequence[ReconstructedMesh], images: Images, made: list[bpy.types.ID]
    ) -> None:
        self._images, self._made = images, made
        self._users = Counter(one for mesh in meshes for one in set(mesh.materials) if one.name)
        self._shared: dict[MeshMaterial, bpy.types.Material] = {}

    def of(self, mesh: ReconstructedMesh) -> list[bpy.types.Material]:
        """In the order of `mesh.materials`. Raises BadInput for a picture that cannot be read."""
        return [self._find(one, mesh) for one in mesh.materials]

    def _find(self, wanted: MeshMaterial, mesh: ReconstructedMesh) -> bpy.types.Material:
        if wanted in self._shared:
            return self._shared[wanted]
        has_uvs = mesh.uvs is not None
        if self._users[wanted] > 1:
            self._shared[wanted] = self._new(wanted.name, wanted, has_uvs)
            return self._shared[wanted]
        texture = wanted.texture.stem if isinstance(wanted.texture, Path) else ""
        alone = len(mesh.materials) == 1
        return self._new(
            mesh.name if alone else wanted.name or texture or mesh.name, wanted, has_uvs
        )

    def _new(self, name: str, wanted: MeshMaterial, has_uvs: bool) -> bpy.types.Material:
        """A Principled BSDF that is no metal, with the usual specular level, and the texture for
        its base colour; white without one."""
        material = bpy.data.materials.new(name)
        self._made.append(material)
        material.use_nodes = True
        tree = material.node_tree
        node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        node.inputs["Metallic"].default_value = 0.0
        next(node.inputs[name] for name in _SPECULAR if name in node.inputs).default_value = 0.5
        node.inputs["Base Color"].default_value = (*wanted.color, 1.0)
        if wanted.texture is not None and has_uvs:
            node.inputs["Base Color"].default_value = (*WHITE, 1.0)
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = self._image(wanted.texture, wanted.color)
            texture.location = (node.location.x - 320, node.location.y)
            known = texture.bl_rna.properties["extension"]
            assert isinstance(known, bpy.types.EnumProperty)  # noqa: S101 - so RNA has it
            extensions = known.enum_items
            if wanted.extension in extensions:  # Blender 3.4 does not mirror
                texture.extension = wanted.extension
            shown = texture.outputs["Color"]
            if wanted.times_colors:
                colors = tree.nodes.new("ShaderNodeVertexColor")
                colors.layer_name = COLORS
                shown = self._times(tree, shown, colors.outputs["Color"])
            tree.links.new(shown, node.inputs["Base Color"])
        return material

    @staticmethod
    def _times(
        tree: bpy.types.NodeTree,
        first: bpy.types.NodeSocket,
        second: bpy.types.NodeSocket,
    ) -> bpy.types.NodeSocket:
        """The product of two colours."""
        node = tree.nodes.new("ShaderNodeMix")
        node.data_type, node.blend_type = "RGBA", "MULTIPLY"
        node.inputs[0].default_value = 1.0
        node.location = (first.node.location.x + 160, first.node.location.y - 160)
        one, other = [socket for socket in node.inputs if socket.type == "RGBA"]
        tree.links.new(first, one)
        tree.links.new(second, other)
        return next(socket for socket in node.outputs if socket.type == "RGBA")

    def _image(
        self, texture: Path | PackedPicture, factor: tuple[float, float, float]
    ) -> bpy.types.Image:
        """The picture, times a factor in linear light, so that the image alone is the base
        colour and can be fitted."""
        if factor != WHITE:
            texture = _scaled(texture, factor)
        if isinstance(texture, PackedPicture):
            return self._images.pack(texture)
        return self._images.load(texture)


def _scaled(texture: Path | PackedPicture, factor: tuple[float, float, float]) -> PackedPicture:
    """As PNG of 16 bits, or OpenEXR where the picture has floats. Raises BadInput."""
    name = texture.name
    with tempfile.TemporaryDirectory(prefix="selenite-") as folder:
        file = Path(folder) / "picture"
        if isinstance(texture, PackedPicture):
            file.write_bytes(texture.data)
        else:
            file = texture
        try:
            pixels, _, info = native.image().read(str(file))
            pixels = np.ascontiguousarray(pixels * np.asarray(factor, np.float32))
            scaled = Path(folder) / "scaled"
            if info["float"]:
                native.image().write_exr(str(scaled), pixels)
            else:
                native.image().write_png(str(scaled), pixels, 16)
        except (OSError, ValueError, MemoryError) as error:
            raise BadInput(unreadable(f"Picture '{name}' of the mesh", error)) from error
        return PackedPicture(Path(name).stem, scaled.read_bytes())
