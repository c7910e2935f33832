# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage as a native scene; no Blender needed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from selenite import native

from . import stage

OWNER = "Body"


def add_mesh(builder: Any, name: str, mesh: stage.Mesh, *, with_uvs: bool = False) -> int:
    """Its index; `with_uvs`: with those of the stage."""
    uv_maps = []
    if with_uvs:
        uv_maps.append((stage.UV_MAP, np.ascontiguousarray(stage.uvs(mesh), np.float32)))
    return builder.add_mesh(
        name,
        np.ascontiguousarray(mesh.positions, np.float32),
        np.ascontiguousarray(mesh.triangles, np.int32),
        np.ascontiguousarray(mesh.normals[mesh.triangles].reshape(-1, 3), np.float32),
        np.ascontiguousarray(mesh.slots, np.int32),
        uv_maps=uv_maps,
    )


def make(
    mesh: str, lighting: str, values: dict[str, Any], cameras: int,
    albedo_grid: np.ndarray | None = None, image: np.ndarray | None = None,
) -> Any:  # noqa: ANN401  # fmt: skip
    """Native scene with the object as material `Body` of the given values, cameras `Camera 1`..

    albedo_grid: (nz, ny, nx, 3) over the box around the object. image: (h, w, 3) sRGB code values,
    row 0 at the top, in place of the base colour.
    """
    described = stage.make(mesh, lighting, cameras)
    return build(described, values, albedo_grid=albedo_grid, image=image)


def build(
    described: stage.Stage,
    values: dict[str, Any],
    tile: dict[str, Any] | None = None,
    albedo_grid: np.ndarray | None = None,
    image: np.ndarray | None = None,
) -> Any:  # noqa: ANN401
    """The same; `tile`: values of both kinds of tiles in place of their own."""
    builder = native.core().SceneBuilder()
    grids, maps = {}, {}
    if albedo_grid is not None:
        to_unit = _to_unit(described.body.positions)
        grids["albedo"] = {"name": "albedo", "values": albedo_grid, "to_unit": to_unit}
    if image is not None:
        texture = builder.add_texture(
            "Image", np.ascontiguousarray(image, np.float32), encoded=True,
            extension=stage.EXTENSION, interpolation=stage.INTERPOLATION,
        )  # fmt: skip
        maps["base_color"] = {"texture": texture, "attribute": "", "uv": np.eye(2, 3)}
    body = builder.add_material(OWNER, values, maps=maps, grids=grids)
    tiles = [
        builder.add_material(f"Tile {i}", tile or {"base_color": [level] * 3, "roughness": 1.0})
        for i, level in enumerate(stage.TILE_COLOURS)
    ]
    for name, mesh, slots in (("Body", described.body, [body]), ("Floor", described.floor, tiles)):
        added = add_mesh(builder, name, mesh, with_uvs=bool(maps) and name == "Body")
        builder.add_object(name, added, np.eye(4), slots)
    lamp = described.lamp
    if lamp is not None:
        size = (lamp.side, lamp.side)
        builder.add_area_light("Lamp", lamp.matrix, lamp.power, (1, 1, 1), "SQUARE", *size, np.pi)
    builder.set_world(described.world, 1.0, described.sky)
    for i, matrix in enumerate(described.cameras):
        builder.add_camera(
            f"Camera {i + 1}", matrix, "PERSP", stage.LENS_MM, *stage.SENSOR_MM, "AUTO", 0, 0, 1,
            *stage.CLIP,
        )  # fmt: skip
    return builder.build()


def _to_unit(positions: np.ndarray) -> np.ndarray:
    """(4, 4): the box around the points to the unit cube."""
    low, high = positions.min(axis=0), positions.max(axis=0)
    matrix = np.diag([*(1 / (high - low)), 1.0])
    matrix[:3, 3] = -low / (high - low)
    return matrix


def coverage(mesh: str, lighting: str, cameras: int, size: int) -> np.ndarray:
    """(cameras, size, size): the share of each pixel that shows the object, from 16 samples."""
    dark = {"base_color": [0.0] * 3, "specular_level": 0.0}
    unlit = stage.make(mesh, lighting, cameras)
    unlit = replace(unlit, lamp=None, world=(0.0, 0.0, 0.0), sky=None)
    glowing = {"emission_color": [1.0] * 3, "emission_strength": 1.0}
    scene = build(unlit, dark | glowing, dark)
    films = [native.core().render(scene, c, size, size, 16, threads=1) for c in scene.cameras]
    return np.stack([np.asarray(film.image).mean(axis=2) for film in films])
