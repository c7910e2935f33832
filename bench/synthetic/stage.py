# SPDX-License-Identifier: GPL-3.0-or-later
"""One object on a chequered floor, lit in two ways, up to four cameras: as arrays.

Every renderer of the benchmarks builds its scene from these, in a Python of its own: nothing but
NumPy here. Lengths in metres, z is up.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MESHES = ("dents", "bunny_6598", "koala_7116", "skull_10312")
LIGHTINGS = ("lamp", "sky")
#: Side of the lamps: that of LIGHTINGS, and one whose light gets through refraction by rare paths.
LAMPS = {"lamp": 2.5, "small lamp": 0.6}
_NEIGHBOUR = Path(__file__).parents[3] / "shared"  # the checkout
_SHARED = Path(os.environ.get("SELENITE_SHARED_DIR", _NEIGHBOUR))
_TILES = 8

#: Base colours (grey) of the two kinds of tiles; their roughness is 1.
TILE_COLOURS = (0.2, 0.6)
#: Of every camera: focal length and sensor in mm; the longer side of the picture sees its width.
LENS_MM, SENSOR_MM = 70.0, (36.0, 24.0)
CLIP = (0.01, 99.0)
#: The UV map of a body that shows an image, and how the image goes on outside and between texels.
UV_MAP, EXTENSION, INTERPOLATION = "UVMap", "REPEAT", "Linear"


@dataclass(frozen=True)
class Mesh:
    """positions (n, 3), triangles (m, 3), unit vertex normals (n, 3), material slots (m,)."""

    positions: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    slots: np.ndarray


@dataclass(frozen=True)
class Lamp:
    """A square that emits `power` watts evenly along its -z axis; matrix (4, 4) to world."""

    matrix: np.ndarray
    power: float
    side: float


@dataclass(frozen=True)
class Stage:
    """Slots of the floor are the kinds of tiles. World: radiance (3,), and `sky`, which multiplies
    it by direction: (h, w, 3), equirectangular, zenith at the top, +x in the middle, or None.
    Cameras: (4, 4) to world, looking along -z."""

    body: Mesh
    floor: Mesh
    lamp: Lamp | None
    world: tuple[float, float, float]
    sky: np.ndarray | None
    cameras: tuple[np.ndarray, ...]


def make(mesh: str, lighting: str, cameras: int) -> Stage:
    """mesh: of MESHES. lighting: of LIGHTINGS or LAMPS. cameras: how many, all around the body."""
    centre = np.array((0, 0, 0.85))
    eyes = []
    for i in range(cameras):
        angle = 2 * np.pi * i / cameras - 1.8
        eyes.append(centre + 5.2 * np.array((np.cos(angle), np.sin(angle), 0.35)))
    lit = lighting in LAMPS
    place = look_at(np.array((2.5, -2.0, 3.5)), centre)
    shape = _body(mesh)
    return Stage(
        Mesh(*shape, normals(*shape), np.zeros(len(shape[1]), int)),
        _floor(),
        Lamp(place, 250.0, LAMPS[lighting]) if lit else None,
        (0.25, 0.28, 0.32) if lit else (1.0, 1.0, 1.0),
        None if lit else _sky(),
        tuple(look_at(eye, centre) for eye in eyes),
    )


def icosphere(levels: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Unit sphere of 20 * 4**levels triangles."""
    golden = (1 + 5**0.5) / 2
    corners = [(-1, golden, 0), (1, golden, 0), (-1, -golden, 0), (1, -golden, 0)]
    points = [(x, y, z) for x, y, z in corners]
    points += [(z, x, y) for x, y, z in corners] + [(y, z, x) for x, y, z in corners]
    positions = np.array(points, np.float64)
    # Faces: the triples of corners that are all one edge (length 2) apart.
    near = np.abs(np.linalg.norm(positions[:, None] - positions[None], axis=2) - 2) < 1e-9
    faces = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                if near[a, b] and near[b, c] and near[a, c]:
                    normal = np.cross(positions[b] - positions[a], positions[c] - positions[a])
                    faces.append((a, b, c) if normal @ positions[a] > 0 else (a, c, b))
    triangles = np.array(faces)
    for _ in range(levels):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, index = np.unique(edges, axis=0, return_inverse=True)
        middle = index.reshape(-1, 3) + len(positions)
        positions = np.vstack([positions, positions[unique].mean(axis=1)])
        a, b, c = triangles.T
        ab, bc, ca = middle.T
        triangles = np.vstack([
            np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        ])  # fmt: skip
    return positions / np.linalg.norm(positions, axis=1, keepdims=True), triangles


def dented_sphere() -> tuple[np.ndarray, np.ndarray]:
    """A sphere with eight smooth dents of a fixed pattern."""
    positions, triangles = icosphere()
    random = np.random.default_rng(7)
    centres = random.normal(size=(8, 3))
    centres /= np.linalg.norm(centres, axis=1, keepdims=True)
    depth = sum(np.exp((positions @ centre - 1) / 0.06) for centre in centres)
    return positions * (1 - 0.16 * depth)[:, None], triangles


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and triangles of an OBJ file; polygons become fans."""
    positions, triangles = [], []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            positions.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            face = [int(word.split("/")[0]) for word in words[1:]]
            face = [i - 1 if i > 0 else i + len(positions) for i in face]
            triangles += [(face[0], b, c) for b, c in zip(face[1:], face[2:], strict=False)]
    return np.array(positions), np.array(triangles)


def _body(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Standing on z = 0 around the z axis, 2 high at most."""
    if name == "dents":
        positions, triangles = dented_sphere()
    else:
        positions, triangles = read_obj(_SHARED / "data" / "meshes" / f"{name}.obj")
        if name != "koala_7116":  # y is up in the others
            positions = positions[:, [0, 2, 1]] * (1, -1, 1)
    low, high = positions.min(axis=0), positions.max(axis=0)
    positions = (positions - (low + high) / 2) * (2 / (high - low).max())
    positions[:, 2] -= positions[:, 2].min() - 1e-3  # clear of the floor
    return positions, triangles


def normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Of the vertices, weighted with the areas of the triangles around them."""
    a, b, c = positions[triangles].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    vertex = np.zeros_like(positions)
    for corner in range(3):
        np.add.at(vertex, triangles[:, corner], face)
    return vertex / np.maximum(np.linalg.norm(vertex, axis=1, keepdims=True), 1e-30)


def uvs(mesh: Mesh) -> np.ndarray:
    """(3m, 2) of the corners of the triangles: u goes once around the vertical axis through the
    middle of the mesh, v from its bottom to its top, 0 to 1.

    What lies behind one another as seen from the axis shares its place. An image must repeat:
    triangles over the seam go on beyond 1, or they would show the whole of it backwards.
    """
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    x, y, _ = (mesh.positions - (low + high) / 2).T
    around = (np.arctan2(y, x) / (2 * np.pi) + 0.5)[mesh.triangles]
    around[around < around.max(axis=1, keepdims=True) - 0.5] += 1
    height = ((mesh.positions[:, 2] - low[2]) / (high - low)[2])[mesh.triangles]
    return np.stack([around, height], axis=2).reshape(-1, 2)


def _floor() -> Mesh:
    edge = np.linspace(-4, 4, _TILES + 1)
    x, y = np.meshgrid(edge, edge, indexing="ij")
    positions = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    triangles, slots = [], []
    for i in range(_TILES):
        for j in range(_TILES):
            a = i * (_TILES + 1) + j
            b, c, d = a + _TILES + 1, a + _TILES + 2, a + 1
            triangles += [(a, b, c), (a, c, d)]
            slots += [(i + j) % 2] * 2
    faces = np.array(triangles)
    return Mesh(positions, faces, normals(positions, faces), np.array(slots))


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Matrix of a camera or lamp at `eye`, its -z axis to `target`."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = eye
    return matrix


def _sky() -> np.ndarray:
    """A clear evening: bluish above, warm at the horizon, one soft bright spot, dark ground."""
    height, width = 64, 128
    elevation = np.pi * (0.5 - (np.arange(height) + 0.5) / height)[:, None, None]
    azimuth = 2 * np.pi * ((np.arange(width) + 0.5) / width)[None, :, None]
    up = np.sin(elevation).clip(0)
    colour = (1 - up) * np.array((0.9, 0.7, 0.5)) + up * np.array((0.25, 0.4, 0.8))
    picture = np.where(elevation > 0, colour, 0.15) + 0 * azimuth
    towards = np.cos(elevation) * np.cos(azimuth - 1.1) * np.cos(0.7)
    towards = towards + np.sin(elevation) * np.sin(0.7)
    picture = picture + 12 * np.exp((towards - 1) / 0.03) * np.array((1, 0.9, 0.75))
    return np.ascontiguousarray(picture, np.float32)
