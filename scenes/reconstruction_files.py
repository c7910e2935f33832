# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction in the words of the programs that make them: Metashape's camera XML with X3D,
COLMAP in text and binary, NeRF's transforms.json, and the mesh as OBJ. Needs no Blender.

Written after the descriptions of the formats (Metashape user manual, appendix on camera models;
COLMAP documentation, "Output Format"; instant-ngp, "Tips for training NeRF models"), apart from the
add-on's readers, so that the one checks the other.
"""

import json
import math
import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

#: COLMAP's number of the model OPENCV: fx, fy, cx, cy, k1, k2, p1, p2.
_OPENCV = 4
#: Of the chunk in the XML: what a component's transform has to undo.
_CHUNK_SCALE, _CHUNK_SHIFT = 0.25, np.array([0.5, -0.25, 2.0])


@dataclass(frozen=True)
class Lens:
    """In pixels; Brown's coefficients, p1 and p2 in Metashape's order."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    def pixels(self, slopes: np.ndarray) -> np.ndarray:
        """(..., 2) slopes of rays, x to the right and y down -> (..., 2) pixels of the photo."""
        x, y = np.moveaxis(slopes, -1, 0)
        r2 = x * x + y * y
        radial = 1 + self.k1 * r2 + self.k2 * r2 * r2
        u = x * radial + self.p1 * (r2 + 2 * x * x) + 2 * self.p2 * x * y
        v = y * radial + self.p2 * (r2 + 2 * y * y) + 2 * self.p1 * x * y
        return np.stack([self.cx + self.fx * u, self.cy + self.fy * v], axis=-1)

    def slopes(self, pixels: np.ndarray) -> np.ndarray:
        """The inverse, by fixed-point steps."""
        aim = (pixels - (self.cx, self.cy)) / (self.fx, self.fy)
        found = aim.copy()
        for _ in range(200):
            shown = (self.pixels(found) - (self.cx, self.cy)) / (self.fx, self.fy)
            found += aim - shown
            if np.abs(aim - shown).max() < 1e-12:
                break
        return found


@dataclass(frozen=True)
class Camera:
    """to_world: 4 x 4 of a camera that looks along +z, y down."""

    label: str
    to_world: np.ndarray
    lens: Lens

    def project(self, points: np.ndarray) -> np.ndarray:
        """(n, 3) of the world -> (n, 2) pixels of the photo, as the lens distorts it."""
        seen = (points - self.to_world[:3, 3]) @ self.to_world[:3, :3]
        return self.lens.pixels(seen[:, :2] / seen[:, 2:])


@dataclass(frozen=True)
class Mesh:
    """positions, normals (n, 3); triangles (m, 3); uvs (n, 2)."""

    positions: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    uvs: np.ndarray


def write_metashape(path: Path, cameras: list[Camera]) -> None:
    """Camera XML: one sensor for each camera, poses in a chunk of another scale, one camera that
    was not aligned."""
    turn = _about_z(0.7)
    sensors, poses = [], []
    for number, camera in enumerate(cameras):
        lens = camera.lens
        size = f'<resolution width="{lens.width}" height="{lens.height}"/>'
        values = {
            "f": lens.fy,
            "b1": lens.fx - lens.fy,
            "cx": lens.cx - lens.width / 2,
            "cy": lens.cy - lens.height / 2,
            "k1": lens.k1,
            "k2": lens.k2,
            "p1": lens.p1,
            "p2": lens.p2,
        }
        found = "".join(f"<{name}>{value!r}</{name}>" for name, value in values.items())
        sensors.append(
            f'<sensor id="{number}" label="lens {number}" type="frame">{size}'
            f'<calibration type="frame" class="initial">{size}<f>1000</f></calibration>'
            f'<calibration type="frame" class="adjusted">{size}{found}</calibration></sensor>'
        )
        inside = np.eye(4)
        inside[:3, :3] = turn.T @ camera.to_world[:3, :3]
        place = (camera.to_world[:3, 3] - _CHUNK_SHIFT) / _CHUNK_SCALE
        inside[:3, 3] = turn.T @ place
        poses.append(
            f'<camera id="{number}" sensor_id="{number}" component_id="0" '
            f'label="{camera.label}"><transform>{_numbers(inside)}</transform></camera>'
        )
    poses.append(
        f'<camera id="{len(cameras)}" sensor_id="0" component_id="0" label="not aligned"/>'
    )
    transform = (
        f"<rotation>{_numbers(turn)}</rotation>"
        f"<translation>{_numbers(_CHUNK_SHIFT)}</translation><scale>{_CHUNK_SCALE}</scale>"
    )
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n<document version="2.0.0"><chunk label="Chunk 1">'
        f"<sensors>{''.join(sensors)}</sensors>"
        f'<components><component id="0"><transform>{transform}</transform></component></components>'
        f'<cameras><group id="0" label="Group 1">{"".join(poses)}</group></cameras>'
        "</chunk></document>\n",
        encoding="utf-8",
    )


def write_x3d(path: Path, mesh: Mesh, cameras: list[Camera], texture: str = "") -> None:
    """The mesh, and Viewpoints that know a field of view alone."""
    views = []
    for camera in cameras:
        lens = camera.lens
        angle = 2 * math.atan(min(lens.width / lens.fx, lens.height / lens.fy) / 2)
        x, y, z, turn = _axis_angle(camera.to_world[:3, :3] @ np.diag([1.0, -1.0, -1.0]))
        views.append(
            f'<Viewpoint description="{camera.label}" position="{_numbers(camera.to_world[:3, 3])}"'
            f' orientation="{x!r} {y!r} {z!r} {turn!r}" fieldOfView="{angle!r}"/>'
        )
    corners = " ".join(f"{a} {b} {c} -1" for a, b, c in mesh.triangles)
    picture = f"<ImageTexture url='\"{texture}\"'/>" if texture else ""
    path.write_text(
        '<?xml version="1.0" encoding="UTF-8"?>\n<X3D profile="Immersive" version="3.0"><Scene>'
        f"{''.join(views)}<Shape><Appearance><Material diffuseColor='1 1 1'/>{picture}"
        f'</Appearance><IndexedFaceSet solid="false" coordIndex="{corners}">'
        f'<Coordinate point="{_numbers(mesh.positions)}"/>'
        f'<Normal vector="{_numbers(mesh.normals)}"/>'
        f'<TextureCoordinate point="{_numbers(mesh.uvs)}"/>'
        "</IndexedFaceSet></Shape></Scene></X3D>\n",
        encoding="utf-8",
    )


def write_obj(path: Path, mesh: Mesh) -> None:
    """Text, without a material."""
    lines = [f"v {_numbers(place)}" for place in mesh.positions]
    lines += [f"vt {_numbers(place)}" for place in mesh.uvs]
    lines += [f"vn {_numbers(place)}" for place in mesh.normals]
    lines += ["f " + " ".join(f"{i}/{i}/{i}" for i in corners + 1) for corners in mesh.triangles]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def write_colmap(
    folder: Path, cameras: list[Camera], photos: list[str], points: np.ndarray, *, binary: bool
) -> None:
    """cameras, images and points3D; a camera for each photo, of the model OPENCV."""
    folder.mkdir(parents=True, exist_ok=True)
    poses = []
    for camera in cameras:
        rotation = camera.to_world[:3, :3].T
        poses.append((_quaternion(rotation), -rotation @ camera.to_world[:3, 3]))
    (_write_binary if binary else _write_text)(folder, cameras, photos, poses, points)


def write_transforms(path: Path, cameras: list[Camera], photos: list[str]) -> None:
    """Intrinsics in every frame; cameras look along -z, y up."""
    frames = []
    for camera, photo in zip(cameras, photos, strict=True):
        lens = camera.lens
        frames.append(
            {
                "file_path": photo,
                "w": lens.width,
                "h": lens.height,
                "fl_x": lens.fx,
                "fl_y": lens.fy,
                "cx": lens.cx,
                "cy": lens.cy,
                "k1": lens.k1,
                "k2": lens.k2,
                "p1": lens.p2,  # OpenCV's order
                "p2": lens.p1,
                "transform_matrix": (camera.to_world @ np.diag([1.0, -1.0, -1.0, 1.0])).tolist(),
            }
        )
    data = {"camera_model": "OPENCV", "frames": frames}
    path.write_text(json.dumps(data, indent=1), encoding="utf-8")


Pose = tuple[np.ndarray, np.ndarray]


def _opencv(lens: Lens) -> list[float]:
    return [lens.fx, lens.fy, lens.cx, lens.cy, lens.k1, lens.k2, lens.p2, lens.p1]


def _write_text(
    folder: Path, cameras: list[Camera], photos: list[str], poses: list[Pose], points: np.ndarray
) -> None:
    lines = ["# Camera list with one line of data per camera:"]
    for number, camera in enumerate(cameras, 1):
        size = f"{camera.lens.width} {camera.lens.height}"
        lines.append(f"{number} OPENCV {size} {_numbers(np.array(_opencv(camera.lens)))}")
    (folder / "cameras.txt").write_text("\n".join([*lines, ""]))
    lines = ["# Image list with two lines of data per image:"]
    for number, ((turn, shift), photo) in enumerate(zip(poses, photos, strict=True), 1):
        lines += [f"{number} {_numbers(turn)} {_numbers(shift)} {number} {photo}", ""]
    (folder / "images.txt").write_text("\n".join([*lines, ""]))
    lines = ["# 3D point list with one line of data per point:"]
    lines += [f"{n} {_numbers(place)} 128 128 128 0.5" for n, place in enumerate(points, 1)]
    (folder / "points3D.txt").write_text("\n".join([*lines, ""]))


def _write_binary(
    folder: Path, cameras: list[Camera], photos: list[str], poses: list[Pose], points: np.ndarray
) -> None:
    data = struct.pack("<Q", len(cameras))
    for number, camera in enumerate(cameras, 1):
        data += struct.pack("<iiQQ", number, _OPENCV, camera.lens.width, camera.lens.height)
        data += struct.pack("<8d", *_opencv(camera.lens))
    (folder / "cameras.bin").write_bytes(data)
    data = struct.pack("<Q", len(cameras))
    for number, ((turn, shift), photo) in enumerate(zip(poses, photos, strict=True), 1):
        data += struct.pack("<i7di", number, *turn, *shift, number)
        data += photo.encode() + b"\0" + struct.pack("<Q", 0)
    (folder / "images.bin").write_bytes(data)
    data = struct.pack("<Q", len(points))
    for number, place in enumerate(points, 1):
        data += struct.pack("<Q3d3BdQ", number, *place, 128, 128, 128, 0.5, 0)
    (folder / "points3D.bin").write_bytes(data)


def _numbers(values: np.ndarray) -> str:
    """All digits of doubles, row by row."""
    return " ".join(repr(float(value)) for value in np.asarray(values).ravel())


def _about_z(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """(w, x, y, z) of a rotation, from the eigenvector of Bar-Itzhack's matrix (2000)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    matrix = np.array(
        [
            [a - e - i, b + d, c + g, h - f],
            [b + d, e - a - i, f + h, c - g],
            [c + g, f + h, i - a - e, d - b],
            [h - f, c - g, d - b, a + e + i],
        ]
    )
    x, y, z, w = np.linalg.eigh(matrix)[1][:, -1]
    return np.array([w, x, y, z])


def _axis_angle(rotation: np.ndarray) -> tuple[float, float, float, float]:
    w, *axis = _quaternion(rotation)
    length = float(np.linalg.norm(axis))
    x, y, z = (float(value) / length for value in axis) if length > 0 else (0.0, 0.0, 1.0)
    return x, y, z, 2 * math.atan2(length, w)
