# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with photos as soon as they are loaded: their shape, no light, a wrong camera. A
fit would take minutes to find the last."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import bpy

from ...advice.information.job import BackgroundJob, Step
from ...capture import pairing
from ...capture.photo_files import header
from ...capture.prepared import read_captures
from ...capture.request import CaptureRequest, with_ids
from ...capture.scene_captures import captures_of, ids_of, packed_photos
from ...capture.window import ASPECT, window_of
from ...fit.diagnosis.darkness import DARK, problems_of_darkness
from ...fit.plan import build_scene
from ...problems import BadInput, Problem
from ...scene_read.camera import named_cameras
from ...scene_read.hosts import BpyStruct
from ...scene_read.values import SceneValues
from ..state import PAIRING, PROBLEMS, RUN
from ..texts import announce
from ..ticking import redraw

_POLL = 0.2  # seconds
#: Of the problems that are found here.
_KINDS = (ASPECT, DARK, pairing.KIND)
_GREY = (0.5, 0.5, 0.5, 1.0)


class Examining:
    """Work for a thread: `problems` is there at its end, and `cameras`: id of a photo -> the camera
    that it seems to be of."""

    def __init__(
        self,
        values: SceneValues,
        requests: Sequence[CaptureRequest],
        packed: Mapping[str, bytes],
    ) -> None:
        self.problems: list[Problem] = []
        self.cameras: Mapping[str, str] = {}
        self._values, self._packed = values, packed
        names = [camera.name for camera in values.cameras]
        self._requests = [item for item in with_ids(requests, names) if item.camera in names]
        self._stopped = False

    def steps(self) -> Iterator[Step]:
        """One for each part."""
        yield Step(0.0, "comparing photos with cameras")
        self.problems = [*self._of_shape(), *problems_of_darkness(self._values, [], [], [])]
        yield Step(0.2, "comparing photos with cameras")
        if self.problems or not 1 < len(self._values.cameras) <= pairing.MOST:
            return
        if not self._requests or len(self._requests) > pairing.MOST:
            return
        try:
            self._compare()
        except (BadInput, _Stopped):  # a fit says what is wrong
            return

    def cancel(self) -> None:
        """The picture that is rendered now is the last."""
        self._stopped = True

    def _of_shape(self) -> list[Problem]:
        """Photos whose aspect is not their camera's; one Problem for many of them."""
        cameras = {camera.name: camera for camera in self._values.cameras}
        found: list[Problem] = []
        such = ""
        for request in self._requests:
            title = f"Photo '{request.photo}'"
            info = header(title, request.photo, [], self._packed, as_linear=True)
            if info is not None:
                size, before = (info["width"], info["height"]), len(found)
                window_of(cameras[request.camera], request, size, info["orientation"], found)
                if len(found) > before and not such:
                    such = f"'{request.id}' with {size[0]} x {size[1]} pixels"
        found = [item for item in found if item.kind == ASPECT]
        if len(found) < 2:
            return found
        cause = (
            f"{len(found)} of {len(self._requests)} have not the shape that their cameras render"
        )
        return [Problem("Photos", f"{cause}, such as {such}", found[0].cure, ASPECT)]

    def _compare(self) -> None:
        problems: list[Problem] = []
        captures = read_captures(
            self._values, self._requests, pairing.HEIGHT, problems, [], self._packed,
            go_on=self._go_on,
        )  # fmt: skip
        if problems or not captures:
            return
        scene = build_scene(self._values)
        names = [camera.name for camera in self._values.cameras]
        found = pairing.paired(captures, names, scene, self._go_on)
        self.cameras, self.problems = found.camera, found.problems(captures)

    def _go_on(self) -> None:
        if self._stopped:
            raise _Stopped


class _Stopped(Exception):
    """Nobody wants to know any more."""


def examine(scene: bpy.types.Scene, values: SceneValues) -> None:
    """Starts the thread, or without a window does it at once; what it finds comes into the head."""
    PAIRING.cancel()
    job = BackgroundJob(Examining(values, captures_of(scene), packed_photos()))
    PAIRING.start(job, scene.name)
    if bpy.app.background:
        _take(job)
    else:
        bpy.app.timers.register(_wait, first_interval=_POLL)


def _wait() -> float | None:
    job = PAIRING.job
    if job is None:
        return None
    if job.progress()[0]:
        return _POLL
    _take(job)
    redraw(bpy.context)
    return None


def _take(job: BackgroundJob[Examining]) -> None:
    """Into the head. What a fit that began meanwhile says is newer."""
    name, PAIRING.job = PAIRING.scene_name, None
    job.join()
    if not RUN.is_active:
        kept = [item for item in PROBLEMS.get(name, ()) if item.kind not in _KINDS]
        PROBLEMS[name] = [*kept, *job.work.problems]
        CAMERAS[name] = dict(job.work.cameras)


#: Scene name -> id of a photo -> the camera that it seems to be of.
CAMERAS: dict[str, dict[str, str]] = {}


class SELENITE_OT_pair_photos(bpy.types.Operator):
    """Give each photo the camera whose render it resembles"""

    bl_idname = "selenite.pair_photos"
    bl_label = "Swap Photos"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step."""
        scene = context.scene
        wanted, cameras = CAMERAS.pop(scene.name, {}), named_cameras(scene)
        rows = dict(zip(ids_of(scene), scene.selenite.captures, strict=True))
        for name, camera in wanted.items():
            if name in rows and camera in cameras:
                rows[name].camera = cameras[camera]
        _solved(scene, pairing.KIND)
        return {"FINISHED"}


class SELENITE_OT_set_resolution(bpy.types.Operator):
    """Give the scene's renders the size of the photos"""

    bl_idname = "selenite.set_resolution"
    bl_label = "Set Resolution"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """That of most photos."""
        scene = context.scene
        rows = [row for row in scene.selenite.captures if row.enabled and row.photo is not None]
        sizes = [tuple(row.photo.size) for row in rows if min(row.photo.size) > 0]
        if not sizes:
            announce(self, {"WARNING"}, "No photo is loaded")
            return {"CANCELLED"}
        width, height = max(sizes, key=sizes.count)
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.pixel_aspect_x = scene.render.pixel_aspect_y = 1.0
        if len(set(sizes)) > 1:
            announce(self, {"WARNING"}, "The photos have several sizes; give the others Own Size")
        _solved(scene, ASPECT)
        return {"FINISHED"}


class SELENITE_OT_light_world(bpy.types.Operator):
    """Give the world an even grey light of strength 1. Replace it by the light of the photos, or
    tick what is not known of it"""

    bl_idname = "selenite.light_world"
    bl_label = "Light the World"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step; a world with links keeps them, and stays as it is."""
        scene = context.scene
        world: BpyStruct = scene.world or bpy.data.worlds.new("World")
        world.use_nodes = True
        nodes = world.node_tree.nodes
        found = next((node for node in nodes if node.bl_idname == "ShaderNodeBackground"), None)
        inputs = [found.inputs["Color"], found.inputs["Strength"]] if found is not None else []
        if not inputs or any(item.is_linked for item in inputs):
            announce(self, {"WARNING"}, "The world has nodes of its own; light it there")
            return {"CANCELLED"}
        inputs[0].default_value, inputs[1].default_value = _GREY, 1.0
        scene.world = world
        _solved(scene, DARK)
        return {"FINISHED"}


def _solved(scene: bpy.types.Scene, kind: str) -> None:
    left = [item for item in PROBLEMS.get(scene.name, ()) if item.kind != kind]
    PROBLEMS[scene.name] = left


CLASSES = (SELENITE_OT_pair_photos, SELENITE_OT_set_resolution, SELENITE_OT_light_world)
