# SPDX-License-Identifier: GPL-3.0-or-later
"""One object on a chequered floor, lit in two ways, up to four cameras; no Blender needed."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from selenite import native

MESHES = ("dents", "bunny_6598", "koala_7116", "skull_10312")
LIGHTINGS = ("lamp", "sky")
OWNER = "Body"
_BESIDE = Path(__file__).parents[3] / "shared"  # the checkout
_SHARED = Path(os.environ.get("SELENITE_SHARED_DIR", _BESIDE))
_TILES = 8


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


def _normals(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = positions[triangles].transpose(1, 0, 2)
    face = np.cross(b - a, c - a)
    vertex = np.zeros_like(positions)
    for corner in range(3):
        np.add.at(vertex, triangles[:, corner], face)
    vertex /= np.maximum(np.linalg.norm(vertex, axis=1, keepdims=True), 1e-30)
    return vertex[triangles].reshape(-1, 3)


def add_mesh(builder: Any, name: str, mesh: tuple[np.ndarray, np.ndarray], slots: Any) -> int:  # noqa: ANN401
    positions, triangles = mesh
    return builder.add_mesh(
        name,
        np.ascontiguousarray(positions, np.float32),
        np.ascontiguousarray(triangles, np.int32),
        np.ascontiguousarray(_normals(positions, triangles), np.float32),
        np.ascontiguousarray(slots, np.int32),
    )


def _floor() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
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
    return positions, np.array(triangles), np.array(slots)


def looking(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
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


def make(mesh: str, lighting: str, values: dict[str, Any], cameras: int) -> Any:  # noqa: ANN401
    """Native scene with the object as material `Body` of the given values, cameras `Camera 1`.."""
    builder = native.core().SceneBuilder()
    body = builder.add_material(OWNER, values)
    tiles = [
        builder.add_material(f"Tile {i}", {"base_color": [level] * 3, "roughness": 1.0})
        for i, level in enumerate((0.2, 0.6))
    ]
    shape = _body(mesh)
    index = add_mesh(builder, "Body", shape, np.zeros(len(shape[1])))
    builder.add_object("Body", index, np.eye(4), [body])
    *plane, slots = _floor()
    builder.add_object("Floor", add_mesh(builder, "Floor", tuple(plane), slots), np.eye(4), tiles)
    centre = np.array((0, 0, 0.85))
    if lighting == "lamp":
        lamp = looking(np.array((2.5, -2.0, 3.5)), centre)
        builder.add_area_light("Lamp", lamp, 250.0, (1, 1, 1), "SQUARE", 2.5, 2.5, np.pi)
        builder.set_world((0.25, 0.28, 0.32), 1.0)
    else:
        builder.set_world((1, 1, 1), 1.0, _sky())
    for i in range(cameras):
        angle = 2 * np.pi * i / cameras - 1.8
        eye = centre + 5.2 * np.array((np.cos(angle), np.sin(angle), 0.35))
        builder.add_camera(
            f"Camera {i + 1}", looking(eye, centre), "PERSP", 70, 36, 24, "AUTO", 0, 0, 1, 0.01, 99
        )  # fmt: skip
    return builder.build()
