# SPDX-License-Identifier: GPL-3.0-or-later
"""What every reader of a reconstruction gives: cameras, meshes and points, in no program's terms.

World frame of a reconstruction: right-handed, axes as in its file. Cameras look along +z, x to the
right and y down in the photo. Lengths in units of the file; pixels of the whole photo, whose first
pixel has its centre at (0.5, 0.5). All in double precision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..scene_read.lens import LensDistortion

#: From the axes of a camera that looks along -z with y up, as Blender and OpenGL have it, to those
#: above, and back.
FLIP = np.diag([1.0, -1.0, -1.0])


class ReconstructionError(ValueError):
    """A file cannot be read: its name, the element, the cause and the cure, in one line."""

    def __init__(self, file: Path | str, element: str, cause: str, cure: str) -> None:
        self.file, self.element, self.cause, self.cure = str(file), element, cause, cure
        super().__init__(f"{Path(file).name}: {element}: {cause}; {cure}")


@dataclass(frozen=True)
class Intrinsics:
    """A lens, in pixels of a photo of width x height."""

    width: int
    height: int
    lens: LensDistortion

    @property
    def distorted(self) -> bool:
        """Whether any coefficient differs from 0."""
        return self.lens.distorts


@dataclass(frozen=True)
class ReconstructedCamera:
    """A photo's camera.

    label: as in the file, unique in a reconstruction. camera_to_world: 4 x 4, a rotation and the
    centre. intrinsics: None where the file does not know them (X3D has a field of view only).
    field_of_view: the smaller of both angles in radians, where intrinsics is None; X3D's usual one.
    photo: as named by the file, "" if it names none; the importer looks for it. mask: likewise.
    """

    label: str
    camera_to_world: np.ndarray
    intrinsics: Intrinsics | None = None
    field_of_view: float = math.pi / 4
    photo: str = ""
    mask: str = ""


@dataclass(frozen=True)
class PackedPicture:
    """A picture inside of a mesh's file: its name there and its bytes, as those of a file."""

    name: str
    data: bytes


WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class MeshMaterial:
    """What faces look like. name: as in the file, "" for none; the same one in several meshes is
    one material. texture: a picture's path, or the picture; None: of one colour.
    color: linear, times the texture. times_colors: whether those of the vertices are a factor of
    the texture too. extension: what is beside the texture, as Blender's Image Texture names it."""

    name: str = ""
    texture: Path | PackedPicture | None = None
    color: tuple[float, float, float] = WHITE
    times_colors: bool = False
    extension: str = "REPEAT"


@dataclass(frozen=True)
class ReconstructedMesh:
    """Triangles. positions: (vertices, 3). triangles: (triangles, 3) indices into positions.
    uvs: (triangles, 3, 2) with v up, or None. normals: (triangles, 3, 3) or None.
    colors: (vertices, 3) linear, or None. materials: one at least. material_of: (triangles,)
    indices into materials; None: all have the first."""

    name: str
    positions: np.ndarray
    triangles: np.ndarray
    uvs: np.ndarray | None = None
    normals: np.ndarray | None = None
    colors: np.ndarray | None = None
    materials: tuple[MeshMaterial, ...] = (MeshMaterial(),)
    material_of: np.ndarray | None = None

    @property
    def textured(self) -> bool:
        """Whether any face has a picture."""
        return any(material.texture is not None for material in self.materials)


@dataclass(frozen=True)
class Reconstruction:
    """What a file holds.

    name: the file's, without suffix. points: (n, 3). meters_per_unit: None where the file does not
    say. remarks: what was left out and why, a line each (cameras without a pose, models of lenses
    that Brown's does not cover). region: 4 x 4 of the box of interest, from the cube between -0.5
    and 0.5 to the world, or None. mesh_files: meshes that Blender's own importers read (OBJ, glTF);
    their world is that of the cameras.
    """

    name: str
    cameras: tuple[ReconstructedCamera, ...] = ()
    meshes: tuple[ReconstructedMesh, ...] = ()
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    meters_per_unit: float | None = None
    remarks: tuple[str, ...] = ()
    region: np.ndarray | None = None
    mesh_files: tuple[Path, ...] = ()
