# SPDX-License-Identifier: GPL-3.0-or-later
"""A COLMAP model as its files hold it, and the cameras that it means.

From COLMAP 3.12 on a photo belongs to a frame: the pose of its camera is that of the frame's rig,
followed by that of the sensor in the rig. `images` repeats the product; the frame decides, as in
COLMAP itself (src/colmap/scene/reconstruction_io_text.cc).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...reconstruction import ReconstructedCamera, Reconstruction
from .. import numbers
from ..files import Place
from ..labels import Labels, LeftOut
from .camera_models import ColmapCamera

CAMERA_SENSOR = 0
MOST_IMAGES = 200_000
#: Sine of the angle, and share of the distance, by which a frame and its image may differ.
SAME_POSE = 1e-4


@dataclass(frozen=True)
class RigidTransform:
    """x_to = R(w, x, y, z) x_from + translation."""

    wxyz: np.ndarray
    translation: np.ndarray

    @staticmethod
    def identity() -> RigidTransform:
        """Neither turns nor moves."""
        return RigidTransform(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3))


@dataclass(frozen=True)
class Image:
    """A photo: world to camera, and the camera that took it."""

    number: int
    pose: RigidTransform
    camera: int
    name: str


@dataclass(frozen=True)
class Rig:
    """Rig to sensor, for each sensor (kind, number); None where COLMAP does not know it."""

    number: int
    sensors: dict[tuple[int, int], RigidTransform | None]


@dataclass(frozen=True)
class Frame:
    """World to rig, and the data (sensor, number of the image) taken at that moment."""

    number: int
    rig: int
    pose: RigidTransform
    data: tuple[tuple[tuple[int, int], int], ...]


class Model:
    """What the files of a folder hold. Adding raises ReconstructionError."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.points = np.zeros((0, 3))
        self.remarks: list[str] = []
        self._cameras: dict[int, ColmapCamera] = {}
        self._images: dict[int, tuple[Image, Place]] = {}
        self._rigs: dict[int, Rig] = {}
        self._frames: dict[int, tuple[Frame, Place]] = {}

    def add_camera(self, number: int, camera: ColmapCamera, place: Place) -> None:
        """By its number."""
        if number in self._cameras:
            raise place.error(f"camera {number} comes twice")
        self._cameras[number] = camera

    def add_unknown(self, number: int, name: str, place: Place) -> None:
        """A camera of a model that is not known here."""
        self.add_camera(number, ColmapCamera(None, f"its model {name} is not known"), place)

    def add_rig(self, rig: Rig, place: Place) -> None:
        """By its number."""
        if rig.number in self._rigs:
            raise place.error(f"rig {rig.number} comes twice")
        self._rigs[rig.number] = rig

    def add_frame(self, frame: Frame, place: Place) -> None:
        """By its number."""
        if frame.number in self._frames:
            raise place.error(f"frame {frame.number} comes twice")
        self._frames[frame.number] = frame, place

    def add_image(self, image: Image, place: Place) -> None:
        """By its number."""
        if image.number in self._images:
            raise place.error(f"image {image.number} comes twice")
        if len(self._images) >= MOST_IMAGES:
            raise place.error(f"there are more than {MOST_IMAGES} images", "export fewer")
        self._images[image.number] = image, place

    def reconstruction(self, name: str) -> Reconstruction:
        """Cameras in the order of their names. Raises ReconstructionError."""
        frames = self._frame_of_image()
        labels, left_out, moved = Labels(), LeftOut(), LeftOut("image")
        found = []
        for image, where in sorted(self._images.values(), key=lambda entry: entry[0].name):
            place = where.at(f"image '{image.name}'")
            labels.add(image.name, place)
            camera = self._cameras.get(image.camera)
            if camera is None:
                raise place.error(f"there is no camera {image.camera}")
            pose = self._pose(image, frames.get(image.number), place, moved)
            if camera.intrinsics is None:
                left_out.add(image.name, camera.cause)
                continue
            found.append(ReconstructedCamera(image.name, pose, camera.intrinsics, photo=image.name))
        if not found:
            causes = left_out.causes() or "it has none"
            raise Place(self.folder, "images").error(
                f"none can be used ({causes})", "undistort the photos in COLMAP and read that model"
            )
        remarks = (*self.remarks, *moved.remarks(), *left_out.remarks())
        return Reconstruction(
            name, tuple(found), points=numbers.finite(self.points, Place(self.folder, "points3D")),
            remarks=remarks,
        )  # fmt: skip

    def _frame_of_image(self) -> dict[int, tuple[RigidTransform, RigidTransform]]:
        """World to rig and rig to camera, by the number of the image."""
        found: dict[int, tuple[RigidTransform, RigidTransform]] = {}
        for frame, place in self._frames.values():
            rig = self._rigs.get(frame.rig)
            if rig is None:
                raise place.error(f"frame {frame.number} has the rig {frame.rig}, which is missing")
            for sensor, number in frame.data:
                if sensor[0] != CAMERA_SENSOR:
                    continue
                if sensor not in rig.sensors:
                    raise place.error(f"rig {rig.number} has no camera {sensor[1]}")
                to_sensor = rig.sensors[sensor]
                if to_sensor is not None:
                    found[number] = frame.pose, to_sensor
        return found

    def _pose(
        self, image: Image, frame: tuple[RigidTransform, RigidTransform] | None, place: Place,
        moved: LeftOut,
    ) -> np.ndarray:  # fmt: skip
        own = _matrix(image.pose, place)
        if frame is None:
            return _camera_to_world(own)
        to_world, to_sensor = (_matrix(pose, place) for pose in frame)
        matrix = to_sensor @ to_world
        distance = 1 + np.abs(matrix[:3, 3]).max()
        if np.abs((matrix - own) / (1, 1, 1, distance)).max() > SAME_POSE:
            moved.add(image.name, "its pose is that of its frame, not of images")
        return _camera_to_world(matrix)


def _matrix(pose: RigidTransform, place: Place) -> np.ndarray:
    rotation = numbers.quaternion_rotation(pose.wxyz, place)
    return numbers.pose(rotation, numbers.finite(pose.translation, place))


def _camera_to_world(matrix: np.ndarray) -> np.ndarray:
    return numbers.pose_of_world_to_camera(matrix[:3, :3], matrix[:3, 3])
