# SPDX-License-Identifier: GPL-3.0-or-later
"""One reader for every file: those of this folder, and meshes by Blender's own importers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from .agreement import with_axes_of_cameras
from .blender_mesh import read_with_blender
from .read import GLTF, read_reconstruction
from .readers import tiles
from .reconstruction import Reconstruction


def read_any(file: Path, cameras: Path | None, pictures: tuple[Path, ...] = ()) -> Reconstruction:
    """What `file` holds, with the cameras of another file where one is given. pictures: see
    `read_reconstruction`. Raises ReconstructionError."""
    found = read_reconstruction(file, cameras, pictures)
    for mesh_file in found.mesh_files:
        meshes, remarks = read_with_blender(mesh_file)
        if mesh_file.suffix.lower() in GLTF:
            meshes, remark = with_axes_of_cameras(meshes, found, mesh_file.name)
            remarks = (*remarks, remark)
        found = replace(found, meshes=(*found.meshes, *meshes), remarks=(*found.remarks, *remarks))
    split = [tiles.split(mesh) for mesh in found.meshes]
    missing = [remark for _, remarks in split for remark in remarks]
    meshes = tuple(mesh for mesh, _ in split)
    return replace(found, meshes=meshes, remarks=(*found.remarks, *missing))
