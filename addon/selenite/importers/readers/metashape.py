# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras as Metashape exports them (File > Export > Export Cameras, "Agisoft XML").

A camera's <transform> takes its own axes (x right, y down, z forward) to those of the chunk; the
<transform> of its component, or of the chunk in older files, takes these to the world by a
rotation, a translation and a scale. Source: Metashape Python Reference, Camera.transform and
ChunkTransform.

In a rig the master camera has the <transform>, and the sensors of the others their pose in the
master's axes, in units of the chunk: <rotation> and <location> of a sensor follow the master's
<transform> before the chunk's scale does. (The dialog of Metashape shows metres.) Source:
Metashape Expert Manual of PhotogrammetryCommunity, "The slave-sensor transform", whose rule
slave = master @ [R t] was found with Metashape 2.2; Meta's converter of the rigs of EyefulTower,
metashape_to_krt.py, which scales after that product and is tested with real files of 9 and 22
cameras; myndms, which makes metres of Sensor.location by ChunkTransform.scale.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from ..reconstruction import ReconstructedCamera, Reconstruction
from . import numbers
from .files import Place, shortened
from .labels import Labels, LeftOut
from .metashape_lens import ALIGN, Sensor, read_sensor, turn_and_move
from .xml_tree import attribute, child

UNDISTORT = "undistort the photos in Metashape and export the cameras of those"
NOT_ALIGNED = "it has no pose: Metashape did not align it"
NO_PHOTO = "it has no label, as only what is no photo has"
NAMESAKE = "its label is that of another camera in its rig: rename its photo"


@dataclass(frozen=True)
class Similarity:
    """x_world = scale * rotation @ x + translation."""

    rotation: np.ndarray
    translation: np.ndarray
    scale: float

    def point(self, at: np.ndarray) -> np.ndarray:
        """(3,) of the chunk, in the world."""
        return self.scale * (self.rotation @ at) + self.translation


IDENTITY = Similarity(np.eye(3), np.zeros(3), 1.0)


def is_metashape(root: Element) -> bool:
    """Whether it is the file of a chunk."""
    return root.tag == "document" and root.find("chunk") is not None


def read_metashape(root: Element, file: Path) -> Reconstruction:
    """The cameras of a file's first chunk, and its region. Raises ReconstructionError."""
    place = Place(file, "document")
    chunks = root.findall("chunk")
    chunk = next((one for one in chunks if one.find("cameras") is not None), None)
    if chunk is None:
        raise place.error("no chunk of it has <cameras>", ALIGN)
    remarks = [
        f"chunk '{shortened(one.get('label', ''))}' is not read: one file gives one chunk"
        for one in chunks
        if one is not chunk
    ]
    return _Chunk(chunk, file, remarks).read()


class _Chunk:
    def __init__(self, chunk: Element, file: Path, remarks: list[str]) -> None:
        self.chunk, self.file, self.remarks = chunk, file, remarks
        self.sensors = self._sensors()
        own = chunk.find("transform")
        self.own = IDENTITY if own is None else _similarity(own, Place(file, "chunk, <transform>"))
        self.loose: set[str] = set()
        self.components = self._components()
        self.placed: set[str] = set()
        holder = child(chunk, "cameras", Place(file, "chunk"))
        self.cameras = list(holder.iter("camera"))
        self.labels = _labels(holder)
        self.by_id = {camera.get("id", ""): camera for camera in self.cameras}

    def read(self) -> Reconstruction:
        labels, left_out = Labels(), LeftOut()
        masters = {
            self.labels.get(one) for one in self.cameras if one.find("transform") is not None
        }
        used: set[str] = set()
        found = []
        for element in self.cameras:
            label = self.labels.get(element)
            if label is None:
                left_out.add(f"id {element.get('id', '')}", NO_PHOTO)
                continue
            place = Place(self.file, f"camera '{label}'")
            if element.get("enabled", "true") in ("false", "0"):
                left_out.add(label, "it is disabled in Metashape")
                continue
            leader = self._leader(element, place)
            if leader.find("transform") is None:
                left_out.add(label, NOT_ALIGNED)
                continue
            if leader is not element and label in masters:
                left_out.add(label, NAMESAKE)
                continue
            sensor = self._sensor(element, place)
            if sensor.intrinsics is None:
                left_out.add(label, sensor.cause)
                continue
            labels.add(label, place)
            used.add(element.get("sensor_id", ""))
            pose = self._pose(element, leader, place)
            found.append(ReconstructedCamera(label, pose, sensor.intrinsics, photo=label))
        if not found:
            causes = left_out.causes() or "the chunk is empty"
            other_lens = any(sensor.cause for _, sensor in self.sensors.values())
            cure = UNDISTORT if other_lens else ALIGN
            raise Place(self.file, "cameras").error(f"none can be used ({causes})", cure)
        self.remarks += left_out.remarks()
        of_sensors = LeftOut("sensor")
        for name, (_, sensor) in self.sensors.items():
            for remark in sensor.remarks if name in used else ():
                of_sensors.add(name, remark)
        self.remarks += of_sensors.remarks()
        self._remark_on_components()
        self._remark_on_reference()
        return Reconstruction(
            self.file.stem, tuple(found), remarks=tuple(self.remarks), region=self._region()
        )

    def _leader(self, camera: Element, place: Place) -> Element:
        """The camera whose <transform> says where this one is: itself, or its master."""
        master = camera.get("master_id")
        if master is None or camera.find("transform") is not None:
            return camera
        if master not in self.by_id:
            raise place.error(f"there is no camera {shortened(master)}, its master")
        return self.by_id[master]

    def _sensor(self, camera: Element, place: Place) -> Sensor:
        name = attribute(camera, "sensor_id", place)
        if name not in self.sensors:
            raise place.error(f"there is no sensor {shortened(name)}")
        element, sensor = self.sensors[name]
        if element is not None:
            sensor = read_sensor(element, Place(self.file, f"sensor '{shortened(name)}'"))
            self.sensors[name] = (None, sensor)
        return sensor

    def _sensors(self) -> dict[str, tuple[Element | None, Sensor]]:
        """By id; read when a camera asks for it, as sensors without photos may be incomplete."""
        found: dict[str, tuple[Element | None, Sensor]] = {}
        for element in self.chunk.iterfind("sensors/sensor"):
            place = Place(self.file, "sensor")
            name = attribute(element, "id", place)
            if name in found:
                raise place.error(f"the id {shortened(name)} comes twice")
            found[name] = (element, Sensor(None))
        return found

    def _components(self) -> dict[str, Similarity]:
        found: dict[str, Similarity] = {}
        for element in self.chunk.iterfind("components/component"):
            name = attribute(element, "id", Place(self.file, "component"))
            place = Place(self.file, f"component '{shortened(name)}'")
            if name in found:
                raise place.error("its id comes twice")
            transform = element.find("transform")
            found[name] = self.own if transform is None else _similarity(transform, place)
            if transform is None:
                self.loose.add(name)
        return found

    def _to_world(self, camera: Element, place: Place) -> Similarity:
        name = camera.get("component_id")
        if name is None:
            return next(iter(self.components.values())) if len(self.components) == 1 else self.own
        if name not in self.components:
            if self.components:
                raise place.error(f"there is no component {shortened(name)}")
            return self.own
        self.placed.add(name)
        return self.components[name]

    def _pose(self, camera: Element, leader: Element, place: Place) -> np.ndarray:
        matrix = self._transform(leader, place)
        if leader is not camera:
            # Both sensors are placed in the axes of the rig's master sensor.
            other = self._sensor(leader, place).in_rig
            matrix = matrix @ np.linalg.inv(other) @ self._sensor(camera, place).in_rig
        world = self._to_world(leader if camera.get("component_id") is None else camera, place)
        centre = numbers.finite(world.point(matrix[:3, 3]), place)
        return numbers.pose(world.rotation @ matrix[:3, :3], centre)

    def _transform(self, camera: Element, place: Place) -> np.ndarray:
        """4 x 4, of the camera to the chunk."""
        inner = place.at(f"{place.element}, <transform>")
        values = numbers.numbers(camera.findtext("transform"), inner, 16).reshape(4, 4)
        if np.abs(values[3] - (0, 0, 0, 1)).max() > 1e-9:
            raise inner.error("its last row is not 0 0 0 1")
        return numbers.pose(numbers.nearest_rotation(values[:3, :3], inner), values[:3, 3])

    def _region(self) -> np.ndarray | None:
        """Of the component that the cameras are in, else of the chunk."""
        owners = [*self.chunk.iterfind("components/component"), self.chunk]
        for owner in owners:
            region = owner.find("region")
            if region is None:
                continue
            world = self.own if owner is self.chunk else self.components[owner.get("id", "")]
            if owner is self.chunk and len(self.components) == 1:
                world = next(iter(self.components.values()))
            place = Place(self.file, "region")
            centre = numbers.numbers(region.findtext("center"), place, 3)
            size = numbers.numbers(region.findtext("size"), place, 3)
            turn = numbers.rotation(region.findtext("R"), place)
            found = np.eye(4)
            found[:3, :3] = world.scale * (world.rotation @ turn) * size
            found[:3, 3] = world.point(centre)
            return found
        return None

    def _remark_on_components(self) -> None:
        """Components that nothing ties together lie anywhere to each other."""
        if len(self.placed) > 1 and self.placed & self.loose:
            self.remarks.append(
                f"cameras are in {len(self.placed)} components that are not aligned to each other:"
                " their places do not agree"
            )

    def _remark_on_reference(self) -> None:
        system = (self.chunk.findtext("reference") or "").strip()
        if system and not system.startswith("LOCAL_CS"):
            self.remarks.append(
                "the chunk has geographic coordinates: cameras are in geocentric ones, and a mesh"
                " fits them only if it was exported in local or geocentric coordinates too"
            )


def _labels(holder: Element) -> dict[Element, str]:
    """Of cameras. Those that come twice have the names of their groups before them, as photos in
    folders are grouped."""
    count = Counter(one.get("label") for one in holder.iter("camera"))
    found: dict[Element, str] = {}

    def walk(parent: Element, groups: tuple[str, ...]) -> None:
        for one in parent:
            label = one.get("label")
            if one.tag == "camera" and label is not None:
                found[one] = "/".join((*groups, label)) if count[label] > 1 else label
            walk(one, (*groups, label) if one.tag == "group" and label else groups)

    walk(holder, ())
    return found


def _similarity(element: Element, place: Place) -> Similarity:
    """A <transform> of rotation, translation and scale, or of 16 numbers. What is absent is
    neutral. Raises ReconstructionError."""
    if not len(element) and (element.text or "").strip():
        matrix = numbers.numbers(element.text, place, 16).reshape(4, 4)
        scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        if not scale > 0 or np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-9:
            raise place.error("its matrix is no rotation with a scale and a translation")
        rotation = numbers.nearest_rotation(matrix[:3, :3] / scale, place)
        return Similarity(rotation, matrix[:3, 3], scale)
    rotation, translation = turn_and_move(element, "translation", place)
    scale = 1.0
    if element.find("scale") is not None:
        inner = place.at(f"{place.element}, <scale>")
        scale = numbers.positive(element.findtext("scale"), inner)
    return Similarity(rotation, translation, scale)
