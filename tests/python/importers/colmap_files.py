# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes COLMAP models from known cameras, byte by byte as its documentation says."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from known import HEIGHT, WIDTH, Known, Lens, quaternion, text

#: Number and parameters of a model, from a lens.
MODELS = {
    "SIMPLE_PINHOLE": (0, lambda x: (x.fx, x.cx, x.cy)),
    "PINHOLE": (1, lambda x: (x.fx, x.fy, x.cx, x.cy)),
    "SIMPLE_RADIAL": (2, lambda x: (x.fx, x.cx, x.cy, x.k1)),
    "RADIAL": (3, lambda x: (x.fx, x.cx, x.cy, x.k1, x.k2)),
    "OPENCV": (4, lambda x: (x.fx, x.fy, x.cx, x.cy, x.k1, x.k2, x.p1, x.p2)),
    "FULL_OPENCV": (
        6,
        lambda x: (x.fx, x.fy, x.cx, x.cy, x.k1, x.k2, x.p1, x.p2, x.k3, 0.0, 0.0, 0.0),
    ),
}
#: What a model keeps of a lens.
LENSES = {
    "SIMPLE_PINHOLE": Lens(520.0, 520.0, 327.0, 233.5),
    "PINHOLE": Lens(521.5, 518.25, 327.0, 233.5),
    "SIMPLE_RADIAL": Lens(520.0, 520.0, 327.0, 233.5, -0.1),
    "RADIAL": Lens(520.0, 520.0, 327.0, 233.5, -0.1, 0.05),
    "OPENCV": Lens(521.5, 518.25, 327.0, 233.5, -0.1, 0.05, 0.0, 0.0017, -0.0023),
    "FULL_OPENCV": Lens(521.5, 518.25, 327.0, 233.5, -0.1, 0.05, -0.02, 0.0017, -0.0023),
}
POINT = np.array([0.25, -0.5, 0.125])


def write_text(folder: Path, cameras: list[Known], model: str) -> None:
    """Images have no features but the second, whose line has two."""
    folder.mkdir(parents=True, exist_ok=True)
    values = text(np.array(MODELS[model][1](cameras[0].lens)))
    (folder / "cameras.txt").write_text(f"# Cameras\n1 {model} {WIDTH} {HEIGHT} {values}\n")
    lines = ["# Images", "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME"]
    for number, one in enumerate(cameras, start=1):
        pose = text(np.array([*quaternion(one.rotation), *one.translation]))
        lines += [f"{number} {pose} 1 {one.label}", "1.5 2.5 -1 3 4 7" if number == 2 else ""]
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    (folder / "points3D.txt").write_text(f"# Points\n7 {text(POINT)} 255 0 9 0.5 2 1\n")


def pose_bytes(one: Known) -> bytes:
    return struct.pack("<7d", *quaternion(one.rotation), *one.translation)


def write_binary(folder: Path, cameras: list[Known], model: str) -> None:
    """The files that every version writes."""
    folder.mkdir(parents=True, exist_ok=True)
    kind, values = MODELS[model]
    lens = values(cameras[0].lens)
    head = struct.pack("<QIiQQ", 1, 1, kind, WIDTH, HEIGHT)
    (folder / "cameras.bin").write_bytes(head + struct.pack(f"<{len(lens)}d", *lens))
    images = struct.pack("<Q", len(cameras))
    for number, one in enumerate(cameras, start=1):
        images += struct.pack("<I", number) + pose_bytes(one) + struct.pack("<I", 1)
        images += one.label.encode() + b"\0"
        features = [(1.5, 2.5, 2**64 - 1), (3.0, 4.0, 7)] if number == 2 else []
        images += struct.pack("<Q", len(features))
        images += b"".join(struct.pack("<ddQ", *feature) for feature in features)
    (folder / "images.bin").write_bytes(images)
    point = struct.pack("<QQ3d3BdQ", 1, 7, *POINT, 255, 0, 9, 0.5, 1) + struct.pack("<II", 2, 1)
    (folder / "points3D.bin").write_bytes(point)


def write_rigs(folder: Path, rigs: list[Known], turn: np.ndarray, moved: np.ndarray) -> None:
    """rigs.bin and frames.bin: frame i has image 2i + 1 of camera 1 and image 2i + 2 of camera 2,
    whose pose in the rig is `turn`, `moved`."""
    sensor = struct.pack("<iI?7d", 0, 2, True, *quaternion(turn), *moved)
    (folder / "rigs.bin").write_bytes(struct.pack("<QIIiI", 1, 1, 2, 0, 1) + sensor)
    frames = struct.pack("<Q", len(rigs))
    for index, one in enumerate(rigs):
        frames += struct.pack("<II", index + 1, 1) + pose_bytes(one) + struct.pack("<I", 2)
        for camera in (1, 2):
            frames += struct.pack("<iIQ", 0, camera, 2 * index + camera)
    (folder / "frames.bin").write_bytes(frames)


def write_rigs_as_text(
    folder: Path, rigs: list[Known], turn: np.ndarray, moved: np.ndarray
) -> None:
    """The same as rigs.txt and frames.txt."""
    pose = text(np.array([*quaternion(turn), *moved]))
    (folder / "rigs.txt").write_text(f"# Rigs\n1 2 CAMERA 1 CAMERA 2 1 {pose}\n")
    lines = []
    for index, one in enumerate(rigs):
        pose = text(np.array([*quaternion(one.rotation), *one.translation]))
        data = f"CAMERA 1 {2 * index + 1} CAMERA 2 {2 * index + 2}"
        lines.append(f"{index + 1} 1 {pose} 2 {data}")
    (folder / "frames.txt").write_text("\n".join(lines) + "\n")
