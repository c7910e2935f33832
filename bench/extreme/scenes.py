# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes of one body: in a white world, on paper's half-space, or lit as in a photo.

Every function takes the material's values by name (`Values`) and returns a native scene with the
material `Body` and one camera. `size` is half of the body's extent, in Blender units.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from synthetic import stage
from synthetic.scenes import OWNER, add_mesh
from synthetic.stage import icosphere, look_at

from selenite import native

Values = dict[str, Any]
#: Parameters that only the Principled BSDF of Blender 3 has.
_OLD = ("transmission_roughness",)
Mesh = tuple[np.ndarray, np.ndarray]
#: Of a camera that looks at a mirror: degrees above the horizon, millimetres.
_VIEW, _LENS = 50.0, 100.0


def box(x: float, y: float, z: float) -> Mesh:
    """Half-sizes; every face has vertices of its own, so that normals are those of the faces."""
    square = np.array([(-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)], float)
    positions = []
    for axis in range(3):
        for sign in (1, -1):
            face = np.roll(square * (1, sign, sign), axis, axis=1)
            positions.append(face)
    corners = np.arange(24).reshape(6, 4)
    triangles = np.vstack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    return np.vstack(positions) * (x, y, z), triangles


def sphere(radius: float) -> Mesh:
    positions, triangles = icosphere(3)
    return radius * positions, triangles


def moved(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def _numbers(values: Values) -> Values:
    """One number for a colour means grey."""
    table = native.core().parameters()
    wide = {row["name"] for row in table if row["owner"] == "material" and row["width"] == 3}
    return {
        name: [float(value)] * 3 if name in wide and np.ndim(value) == 0 else value
        for name, value in values.items()
    }


class Stage:
    """Collects one scene; what is added first is the body."""

    def __init__(self, values: Values, mesh: Mesh | None, place: np.ndarray | None = None) -> None:
        self.builder = native.core().SceneBuilder()
        self._place = np.eye(4) if place is None else place
        values = dict(values)
        options = {key: values.pop(key) for key in ("subsurface", "flavour") if key in values}
        if any(name in values for name in _OLD):
            options["flavour"] = "v1"
        self._body = self.builder.add_material(OWNER, _numbers(values), **options)
        if mesh is not None:
            self.add(OWNER, mesh, self._body)

    def add(self, name: str, mesh: Mesh, material: int) -> None:
        whole = stage.Mesh(*mesh, stage.normals(*mesh), np.zeros(len(mesh[1]), int))
        index = add_mesh(self.builder, name, whole)
        self.builder.add_object(name, index, self._place, [material])

    def floor(self, z: float, size: float, level: float) -> None:
        values = {"base_color": [level] * 3, "roughness": 1.0}
        positions = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float) * size
        positions[:, 2] = z
        material = self.builder.add_material("Floor", values)
        self.add("Floor", (positions, np.array([(0, 1, 2), (0, 2, 3)])), material)

    def camera(self, eye: Any, target: Any, lens: float, size: float = 1.0) -> None:  # noqa: ANN401
        matrix = self._place @ look_at(np.array(eye, float), np.array(target, float))
        self.camera_at(matrix, lens, size)

    def camera_at(self, matrix: np.ndarray, lens: float, size: float = 1.0) -> None:
        clip = (1e-3 * size, 1e3 * size)
        self.builder.add_camera(
            "Camera", matrix, "PERSP", lens, 36, 24, "AUTO", 0, 0, 1, *clip
        )  # fmt: skip

    def lamp(self, eye: Any, extent: float, power: float) -> None:  # noqa: ANN401
        matrix = self._place @ look_at(np.array(eye, float), np.zeros(3))
        self.builder.add_area_light(
            "Lamp", matrix, power, (1, 1, 1), "SQUARE", extent, extent, math.pi
        )

    def world(self, level: float, image: np.ndarray | None = None) -> None:
        pixels = None if image is None else np.ascontiguousarray(image, np.float32)
        self.builder.set_world((level,) * 3, 1.0, pixels)

    def build(self) -> Any:  # noqa: ANN401
        return self.builder.build()


def with_degenerate(mesh: Mesh) -> Mesh:
    """The mesh and triangles without an area: all corners one, all on a line, and one of denormal
    size."""
    positions, triangles = mesh
    first = len(positions)
    more = np.array([(0, 0, 2), (1, 1, 2), (2, 2, 2), (1e-42, 0, 2), (0, 1e-42, 2)], float)
    bad = [(0, 0, 0), (0, 1, 1), *((first + a, first + b, first + c) for a, b, c in (
        (0, 1, 2), (0, 0, 1), (0, 3, 4)))]  # fmt: skip
    return np.vstack([positions, more]), np.vstack([triangles, bad])


def lit(
    values: Values,
    size: float = 1.0,
    shift: float = 0.0,
    mesh: Mesh | None = None,
    sky: np.ndarray | None = None,
) -> Any:  # noqa: ANN401
    """A ball over a floor under a lamp and a grey sky: the scene of the derivatives. With `size`
    the lamp's power grows so that the picture stays; `shift` moves everything from the origin."""
    stage = Stage(values, mesh or sphere(size), moved(shift, -shift, shift / 2))
    stage.floor(-1.2 * size, 4 * size, 0.5)
    stage.lamp(np.array((1.5, -1, 3)) * size, 1.5 * size, 60 * size**2)
    stage.camera((0, -4 * size, 1.5 * size), (0, 0, 0), 55, size)
    stage.world(0.4 if sky is None else 1, sky)
    return stage.build()


def empty_lit() -> Any:  # noqa: ANN401
    """`lit` without its body."""
    far = (sphere(1e-3)[0] + (0, 500, 0), sphere(1)[1])
    return lit({}, mesh=far)


def furnace(values: Values) -> Any:  # noqa: ANN401
    """A box with flat faces that fills the picture, in a world of radiance 1."""
    stage = Stage(values, box(1, 1, 1))
    stage.camera((2.4, -3.2, 2), (0, 0, 0), 400)
    stage.world(1)
    return stage.build()


def half_space(values: Values, size: float = 1.0) -> Any:  # noqa: ANN401
    """The middle of a cube's face at right angles, in a world of radiance 1."""
    stage = Stage(values, box(size, size, size))
    stage.camera((0, -4 * size, 0), (0, 0, 0), 500, size)
    stage.world(1)
    return stage.build()


def plate(values: Values, cosine: float = 1.0) -> Any:  # noqa: ANN401
    """A wide plate of thickness 2, seen from above at this cosine; the world is 1 below the
    horizon and black above it, so that the picture is the share that gets through."""
    stage = Stage(values, box(400, 400, 1))
    sine = math.sqrt(1 - cosine**2)
    at = np.array((0, 0, 1.0))
    stage.camera(at + np.array((0.001, -sine, cosine)) * 6, at, 20000)
    sky = np.zeros((2048, 4, 3))  # a horizon of less than a tenth of a degree
    sky[1024:] = 1
    stage.world(1, sky)
    return stage.build()


def plane(
    values: Values,
    elevation: float | None = None,
    view: float = 60.0,
    lamp: float | None = None,
    sky: np.ndarray | None = None,
    lens: float = 5000,
) -> Any:  # noqa: ANN401
    """A plane that fills the picture, seen `view` degrees above its horizon. Light: a sun of
    1 W/m^2 `elevation` degrees high, a ball of radius `lamp` and 1 W two units above, a sky."""
    mesh = (np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float) * 50,
            np.array([(0, 1, 2), (0, 2, 3)]))  # fmt: skip
    stage = Stage(values, mesh)
    angle = math.radians(view)
    stage.camera(5 * np.array((0.01, -math.cos(angle), math.sin(angle))), (0, 0, 0), lens)
    if elevation is not None:
        high = math.radians(elevation)
        matrix = look_at(np.array((math.cos(high), 1e-3, math.sin(high))), np.zeros(3))
        stage.builder.add_sun_light("Sun", matrix, 1.0, (1, 1, 1), 0.0)
    if lamp is not None:
        stage.builder.add_point_light("Lamp", moved(0, 0, 2), 1.0, (1, 1, 1), lamp, False)
    stage.world(1 if sky is not None else 0, sky)
    return stage.build()


def gradient_sky() -> np.ndarray:
    """Radiances between 0.1 and 1 that differ in every direction, (64, 128, 3)."""
    row, column = np.mgrid[0:64, 0:128]
    picture = 0.55 + 0.25 * np.cos(row / 5) + 0.2 * np.cos(column * 2 * np.pi / 128 * 5)
    return np.repeat(picture[:, :, None], 3, axis=2)


def mirror(values: Values) -> Any:  # noqa: ANN401
    """A plane that reflects `gradient_sky`."""
    return plane(values, view=_VIEW, sky=gradient_sky(), lens=_LENS)


def mirrored_view() -> Any:  # noqa: ANN401
    """What a perfect mirror shows of it, with the picture upside down: no plane, and the camera
    below the horizon."""
    far = (np.array([(0, 0, -999.0), (1, 0, -999), (0, 1, -999)]), np.array([(0, 1, 2)]))
    stage = Stage({}, far)
    angle = math.radians(_VIEW)
    matrix = look_at(5 * np.array((0.01, -math.cos(angle), math.sin(angle))), np.zeros(3))
    below = np.diag([1.0, 1, -1, 1]) @ matrix
    below[:3, 1] *= -1  # a right-handed camera again
    stage.camera_at(below, _LENS)
    stage.world(1, gradient_sky())
    return stage.build()
