# SPDX-License-Identifier: GPL-3.0-or-later
"""X3D and VRML97 in XML: meshes with their texture, and Viewpoints as cameras.

Source: ISO/IEC 19775-1 and 19776-1 (XML encoding). A Viewpoint looks along -z with y up; its
fieldOfView is the smaller of both angles (23.3.1).
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ..reconstruction import (
    FLIP,
    MeshMaterial,
    ReconstructedCamera,
    ReconstructedMesh,
    Reconstruction,
)
from . import numbers
from .files import Place, shortened
from .labels import Labels
from .meshes import of_unit_length
from .texture import picture
from .x3d_geometry import READ, Geometry, read_geometry
from .x3d_nodes import Nodes

#: Corners of all meshes together: each has a position, a place in the texture and a normal.
MOST_CORNERS = 30_000_000
#: By how much the sides of a Transform around a Viewpoint may differ.
UNEVEN = 1e-6
#: Of the volume that all Transforms around a mesh leave of one.
SMALLEST = 1e-60


def is_x3d(root: Element) -> bool:
    """Whether it is a scene of X3D."""
    return root.tag == "X3D"


def read_x3d(root: Element, file: Path) -> Reconstruction:
    """All meshes and Viewpoints. Raises ReconstructionError."""
    scene = root.find("Scene")
    if scene is None:
        raise Place(file, "X3D").error("it has no <Scene>")
    nodes = Nodes(scene, file)
    remarks: list[str] = []
    meshes = _meshes(nodes, remarks)
    cameras = _cameras(nodes)
    if nodes.unread:
        remarks.append(f"not read: {', '.join(sorted(nodes.unread))}")
    if not meshes and not cameras:
        raise Place(file, "Scene").error(
            "it has neither a mesh nor a Viewpoint that can be read",
            f"export the mesh as {READ[0]}" if nodes.unread else "export mesh and cameras again",
        )
    return Reconstruction(
        file.name.partition(".")[0] or file.stem, tuple(cameras), tuple(meshes),
        meters_per_unit=_unit(root, file), remarks=tuple(remarks),
    )  # fmt: skip


def _unit(root: Element, file: Path) -> float | None:
    """Of a <unit> in the head; without one the file does not say, as few programs use metres."""
    for unit in root.iterfind("head/unit"):
        if unit.get("category") == "length":
            return numbers.positive(unit.get("conversionFactor"), Place(file, "unit"))
    return None


def _cameras(nodes: Nodes) -> list[ReconstructedCamera]:
    labels = Labels()
    found = []
    for count, (element, matrix) in enumerate(nodes.placed("Viewpoint"), start=1):
        named = element.get("description", "").strip() or element.get("DEF", "").strip()
        place = nodes.place(element)
        label = labels.add(named or f"Viewpoint {count}", place)
        angle = float(nodes.vector(element, "fieldOfView", (math.pi / 4,))[0])
        if not 1e-4 < angle < math.pi:
            at = nodes.place(element, "fieldOfView")
            raise at.error(f"{angle:g} is not between 0.0001 and pi radians")
        turn = _turn(matrix[:3, :3], place) @ nodes.rotation(element, "orientation") @ FLIP
        centre = matrix[:3, :3] @ nodes.vector(element, "position", (0, 0, 10)) + matrix[:3, 3]
        pose = numbers.pose(turn, numbers.finite(centre, place))
        photo = element.get("description", "").strip()
        found.append(ReconstructedCamera(label, pose, field_of_view=angle, photo=photo))
    return found


def _turn(matrix: np.ndarray, place: Place) -> np.ndarray:
    """The rotation of Transforms around a camera."""
    scale = float(np.cbrt(np.linalg.det(matrix)))
    gram = matrix.T @ matrix / max(scale * scale, 1e-300)
    if not scale > 0 or not np.abs(gram - np.eye(3)).max() <= UNEVEN:
        raise place.error(
            "a Transform around it is a mirror or scales its sides differently",
            "apply the scale before the export",
        )
    return numbers.nearest_rotation(matrix / scale, place)


@dataclass
class _Parts:
    """Shapes that share coordinates: faces of one mesh, parted by their Appearance."""

    name: str
    matrix: np.ndarray
    place: Place
    geometries: list[Geometry] = field(default_factory=list)
    appearances: list[Element | None] = field(default_factory=list)


def _meshes(nodes: Nodes, remarks: list[str]) -> list[ReconstructedMesh]:
    found: dict[tuple[int, bytes, int], _Parts] = {}
    used = Counter[tuple[int, bytes]]()
    names: set[str] = set()
    corners = 0
    read: dict[int, Geometry] = {}
    for shape, matrix in nodes.placed("Shape"):
        element = _geometry(shape, nodes)
        if element is None:
            continue
        if id(element) not in read:
            read[id(element)] = read_geometry(element, nodes)
        geometry = read[id(element)]
        if not len(geometry.triangles):
            continue
        corners += geometry.triangles.size
        if corners > MOST_CORNERS:
            raise nodes.place(shape).error(
                f"the meshes have more than {MOST_CORNERS // 3} triangles", "reduce the mesh"
            )
        where = matrix.tobytes()
        # What is used again at the same place is another mesh, which lies on the first.
        again = used[id(element), where]
        used[id(element), where] += 1
        key = id(nodes.child(element, "Coordinate")), where, again
        if key not in found:
            name = _name(shape.get("DEF") or element.get("DEF") or "", names)
            found[key] = _Parts(name, matrix, nodes.place(shape))
        found[key].geometries.append(geometry)
        found[key].appearances.append(nodes.child(shape, "Appearance"))
    return [_mesh(parts, nodes, remarks) for parts in found.values()]


def _geometry(shape: Element, nodes: Nodes) -> Element | None:
    found = nodes.child(shape, *READ)
    if found is None:
        rest = [one.tag for one in shape if one.tag != "Appearance" and "Metadata" not in one.tag]
        nodes.unread.update(shortened(tag) for tag in rest[:5])
    return found


def _name(wanted: str, names: set[str]) -> str:
    base = shortened(wanted) or "mesh"
    name, count = base, 1
    while name in names:
        count += 1
        name = f"{base} {count}"
    names.add(name)
    return name


def _material(appearance: Element | None, nodes: Nodes, remarks: list[str]) -> MeshMaterial:
    """With the first picture of colours that an Appearance has."""
    if appearance is None:
        return MeshMaterial()
    name = appearance.get("DEF", "")
    image = nodes.child(appearance, "ImageTexture", "MultiTexture")
    if image is not None and image.tag == "MultiTexture":
        image = nodes.child(image, "ImageTexture")
    for slot in ("Material", "PhysicalMaterial", "UnlitMaterial"):
        holder = nodes.child(appearance, slot)
        if holder is not None:
            name = name or holder.get("DEF", "")
            image = image if image is not None else nodes.child(holder, "ImageTexture")
    if image is None:
        return MeshMaterial(shortened(name))
    texture = picture(image.get("url", ""), nodes.place(image, "url"), remarks)
    return MeshMaterial(shortened(name), texture)


def _mesh(parts: _Parts, nodes: Nodes, remarks: list[str]) -> ReconstructedMesh:
    """In the world; a mirror turns the triangles over."""
    geometry, matrix = _joined(parts.geometries), parts.matrix
    triangles, uvs, normals = geometry.triangles, geometry.uvs, geometry.normals
    volume = float(np.linalg.det(matrix[:3, :3]))
    if not abs(volume) > SMALLEST:
        raise parts.place.error("the Transforms around it leave nothing of its size")
    if normals is not None:
        # The transposed inverse, up to the length, which is made 1.
        normals = of_unit_length(normals @ np.linalg.inv(matrix[:3, :3]))
    if volume < 0:
        triangles = triangles[:, ::-1]
        uvs = None if uvs is None else uvs[:, ::-1]
        normals = None if normals is None else normals[:, ::-1]
    positions = geometry.positions
    if (matrix != np.eye(4)).any():
        positions = numbers.finite(positions @ matrix[:3, :3].T + matrix[:3, 3], parts.place)
    slots = list({id(one): one for one in parts.appearances}.values())
    materials = tuple(_material(one, nodes, remarks) for one in slots)
    which = None
    if len(slots) > 1:
        lengths = [len(one.triangles) for one in parts.geometries]
        which = np.repeat([slots.index(one) for one in parts.appearances], lengths)
    return ReconstructedMesh(
        parts.name, positions, np.ascontiguousarray(triangles), uvs, normals, geometry.colors,
        materials, which,
    )  # fmt: skip


def _joined(parts: list[Geometry]) -> Geometry:
    """Of shapes with the same positions. UVs where a part has none are 0; normals need all."""
    if len(parts) == 1:
        return parts[0]
    counts = [len(part.triangles) for part in parts]
    uvs, normals = [part.uvs for part in parts], [part.normals for part in parts]
    whole = [one for one in normals if one is not None]
    some = any(one is not None for one in uvs)
    blank = (np.zeros((count, 3, 2)) for count in counts)
    filled = [none if one is None else one for one, none in zip(uvs, blank, strict=True)]
    return Geometry(
        parts[0].positions,
        np.concatenate([part.triangles for part in parts]),
        np.concatenate(filled) if some else None,
        np.concatenate(whole) if len(whole) == len(parts) else None,
        next((part.colors for part in parts if part.colors is not None), None),
    )
