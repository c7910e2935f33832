# SPDX-License-Identifier: GPL-3.0-or-later
"""From a plan to Blender objects: all of them in a new collection, or none.

Nothing that exists is changed, but for the scene's list of captures, which gets more rows, and its
camera, where it had none. The caller makes it one undo step.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import bpy
import mathutils
import numpy as np

from ..scene_read.camera_lens import keep_lens
from ..scene_read.lens import CameraLens, LensDistortion
from .blender_material import Images, Materials
from .blender_mesh import new_mesh
from .lens import SENSOR
from .plan import ImportPlan, PlannedCamera
from .reconstruction import WHITE, ReconstructedMesh

#: Custom properties of the collection: the file; what was subtracted from its coordinates, 3
#: numbers; the matrix from Blender's world to them, 16 numbers row by row.
SOURCE, OFFSET, TO_FILE = "selenite_source", "selenite_offset", "selenite_world_to_file"
#: Of a camera: its label in the file.
LABEL = "selenite_label"
_SMALLEST_CLIP = 1e-6  # Blender's


@dataclass
class Created:
    """What an import has made. cameras: objects by label. materials: of each mesh. captures: how
    many."""

    collection: bpy.types.Collection
    cameras: dict[str, bpy.types.Object] = field(default_factory=dict)
    meshes: list[bpy.types.Object] = field(default_factory=list)
    materials: list[list[bpy.types.Material]] = field(default_factory=list)
    captures: int = 0


def create(
    plan: ImportPlan,
    scene: bpy.types.Scene,
    note: Callable[[str, float], None] = lambda *_: None,
) -> Created:
    """Makes everything of the plan in the scene. note: see `plan.make_plan`. Whatever fails, what
    was made goes away again. Raises BadInput for a picture that Blender cannot read."""
    made: list[bpy.types.ID] = []
    settings = scene.selenite
    rows, active = len(settings.captures), settings.active_capture
    camera_before = scene.camera
    try:
        return _create(plan, scene, made, note)
    except BaseException:
        for index in reversed(range(rows, len(settings.captures))):
            settings.captures.remove(index)
        settings.active_capture = active
        scene.camera = camera_before
        bpy.data.batch_remove(made)
        raise


def _create(
    plan: ImportPlan,
    scene: bpy.types.Scene,
    made: list[bpy.types.ID],
    note: Callable[[str, float], None],
) -> Created:
    collection = bpy.data.collections.new(plan.name)
    made.append(collection)
    collection[SOURCE] = str(plan.source)
    collection[OFFSET] = [float(value) for value in plan.placement.offset]
    collection[TO_FILE] = [float(value) for value in plan.placement.to_file().ravel()]
    created = Created(collection)
    images = Images(made)
    materials = Materials(plan.meshes, images, made)
    for number, mesh in enumerate(plan.meshes):
        note(f"mesh '{mesh.name}'", 0.8 + 0.1 * number / len(plan.meshes))
        created.materials.append(materials.of(mesh))
        created.meshes.append(_add_mesh(mesh, created.materials[-1], collection, made))
    if len(plan.points):
        _add_points(plan, collection, made)
    if plan.region is not None:
        _add_region(plan, collection, made)
    for number, camera in enumerate(plan.cameras):
        note(f"camera '{camera.name}'", 0.9 + 0.1 * number / len(plan.cameras))
        created.cameras[camera.label] = _add_camera(camera, plan, collection, made)
    scene.collection.children.link(collection)
    for camera in plan.cameras:
        if camera.capture is not None:
            _add_row(camera, created.cameras[camera.label], scene, images)
            created.captures += 1
    if scene.camera is None and created.cameras:
        scene.camera = next(iter(created.cameras.values()))
    return created


def show_as_photos(plan: ImportPlan, scene: bpy.types.Scene) -> None:
    """Resolution and pixel aspect of most cameras, for a scene that holds nothing else."""
    if not plan.cameras:
        return
    counts = Counter(
        (item.intrinsics.width, item.intrinsics.height, item.lens.pixel_aspect)
        for item in plan.cameras
    )
    (width, height, aspect), _ = counts.most_common(1)[0]
    render = scene.render
    render.resolution_x, render.resolution_y = width, height
    render.resolution_percentage = 100
    render.pixel_aspect_x, render.pixel_aspect_y = max(aspect, 1.0), max(1 / aspect, 1.0)


def add_white_world(scene: bpy.types.Scene) -> None:
    """Even white light of strength 1: a reconstruction says nothing of light."""
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    node = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    node.inputs["Color"].default_value = (*WHITE, 1.0)
    node.inputs["Strength"].default_value = 1.0
    scene.world = world


def relative_paths(scene: bpy.types.Scene, folder: Path) -> None:
    """Names images and masks inside `folder` from there, as a .blend in it does: so both can move
    together. All else keeps its whole path."""

    def named(text: str) -> str:
        path = Path(text)
        inside = bool(text) and not text.startswith("//") and path.is_relative_to(folder)
        return f"//{path.relative_to(folder).as_posix()}" if inside else text

    for image in bpy.data.images:
        image.filepath = named(image.filepath)
    for row in scene.selenite.captures:
        row.mask_path = named(row.mask_path)


def _add_object(
    name: str, data: bpy.types.ID | None, collection: bpy.types.Collection, made: list[bpy.types.ID]
) -> bpy.types.Object:
    item = bpy.data.objects.new(name, data)
    made.append(item)
    collection.objects.link(item)
    return item


def _add_mesh(
    mesh: ReconstructedMesh,
    materials: Sequence[bpy.types.Material],
    collection: bpy.types.Collection,
    made: list[bpy.types.ID],
) -> bpy.types.Object:
    data = new_mesh(mesh, made)
    for material in materials:
        data.materials.append(material)
    return _add_object(mesh.name, data, collection, made)


def _add_points(
    plan: ImportPlan, collection: bpy.types.Collection, made: list[bpy.types.ID]
) -> None:
    """Vertices that renders pass over."""
    name = f"{plan.name} points"
    data = bpy.data.meshes.new(name)
    made.append(data)
    data.vertices.add(len(plan.points))
    data.vertices.foreach_set("co", plan.points.astype(np.float32).ravel())
    data.update()
    _add_object(name, data, collection, made).hide_render = True


def _add_region(
    plan: ImportPlan, collection: bpy.types.Collection, made: list[bpy.types.ID]
) -> None:
    """The box of interest as an empty, whose cube reaches from -1 to 1."""
    item = _add_object(f"{plan.name} region", None, collection, made)
    item.empty_display_type = "CUBE"
    item.matrix_world = _matrix(plan.region @ np.diag([0.5, 0.5, 0.5, 1.0]))


def _matrix(matrix: np.ndarray) -> mathutils.Matrix:
    return mathutils.Matrix(matrix.tolist())


def _add_camera(
    camera: PlannedCamera,
    plan: ImportPlan,
    collection: bpy.types.Collection,
    made: list[bpy.types.ID],
) -> bpy.types.Object:
    data = bpy.data.cameras.new(camera.name)
    made.append(data)
    data.sensor_fit, data.sensor_width = "HORIZONTAL", SENSOR
    data.lens = camera.lens.lens
    data.shift_x, data.shift_y = camera.lens.shift_x, camera.lens.shift_y
    data.clip_start = max(plan.clip[0], _SMALLEST_CLIP)
    data.clip_end = plan.clip[1]
    data.display_size = plan.clip[1] / 2000
    size = (camera.intrinsics.width, camera.intrinsics.height)
    if camera.is_measured:
        keep_lens(data, CameraLens(size, camera.intrinsics.lens))
    item = _add_object(camera.name, data, collection, made)
    item.matrix_world = _matrix(camera.matrix)
    item[LABEL] = camera.label
    return item


def _add_row(
    camera: PlannedCamera, item: bpy.types.Object, scene: bpy.types.Scene, images: Images
) -> None:
    """The capture, whose photo becomes the camera's background image; see interface.properties."""
    capture = camera.capture
    assert capture is not None and capture.size is not None  # noqa: S101 - see `create`
    settings = scene.selenite
    row = settings.captures.add()
    row.camera = item
    row.photo = images.load(Path(capture.photo))
    row.mask_path = capture.mask
    how = row.how
    how.use_size, how.size = True, capture.size
    of_scene = scene.render.pixel_aspect_x / scene.render.pixel_aspect_y
    if capture.pixel_aspect is not None and not np.isclose(capture.pixel_aspect, of_scene, 1e-7, 0):
        how.use_pixel_aspect, how.pixel_aspect = True, capture.pixel_aspect
    if isinstance(capture.distortion, LensDistortion):
        how.use_distortion = True
        for name in LensDistortion.__dataclass_fields__:
            setattr(how, name, getattr(capture.distortion, name))
    if capture.silhouette is not None:
        how.use_silhouette, how.silhouette = True, capture.silhouette
    settings.active_capture = len(settings.captures) - 1
