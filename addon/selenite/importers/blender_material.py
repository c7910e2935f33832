# SPDX-License-Identifier: GPL-3.0-or-later
"""Images and materials of what is imported."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import bpy

from ..problems import BadInput, Problem
from .reconstruction import MeshMaterial, PackedPicture, ReconstructedMesh

WHITE = (1.0, 1.0, 1.0, 1.0)
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
        node.inputs["Base Color"].default_value = WHITE
        if wanted.texture is not None and has_uvs:
            texture = tree.nodes.new("ShaderNodeTexImage")
            texture.image = self._image(wanted.texture)
            texture.location = (node.location.x - 320, node.location.y)
            tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
        return material

    def _image(self, texture: Path | PackedPicture) -> bpy.types.Image:
        if isinstance(texture, PackedPicture):
            return self._images.pack(texture)
        return self._images.load(texture)
