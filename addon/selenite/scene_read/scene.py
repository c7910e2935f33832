# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene, read in one pass."""

from __future__ import annotations

import bpy
import numpy as np

from ..problems import BadInput, Problem
from . import camera as cameras
from . import lights, materials, mesh, not_rendered, volume_objects, world
from .bodies import judge_bodies
from .nodes import Unreadable
from .render_depsgraph import read_as_rendered, remarks
from .textures import TextureRoom
from .values import MeshValues, ObjectValues, SceneValues


def open_blend(path: str) -> bpy.types.Scene:
    """Opens a .blend file in this process and returns its scene. Raises BadInput."""
    cure = "give the path of a .blend file that this Blender can read"
    try:
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False)
    except RuntimeError as error:
        cause = str(error).removeprefix("Error: ").strip()
        raise BadInput(Problem(f"File '{path}'", f"cannot be opened ({cause})", cure)) from error
    return bpy.context.scene


def read_scene(scene: bpy.types.Scene) -> SceneValues:
    """Reads everything that Cycles would render; changes nothing.

    What cannot be rendered is in `problems`, what is rendered differently in `warnings`. Raises
    NativeUnavailable, since the parameter table is native.
    """
    read = SceneValues(millimetres=_millimetres(scene))
    found = cameras.named_cameras(scene)
    problem = read_as_rendered(
        scene, list(found.values()), lambda depsgraph: _read(scene, found, depsgraph, read)
    )
    if problem is not None:
        read.problems.append(problem)
    _note(read, [], list(remarks(scene)))
    return read


def _read(
    scene: bpy.types.Scene,
    found_cameras: dict[str, bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    read: SceneValues,
) -> None:
    _read_cameras(scene, found_cameras, depsgraph, read)
    # Lamps come last: where names clash, the material keeps the plain name.
    lamps: list[tuple[bpy.types.Light, np.ndarray]] = []
    names: dict[tuple[str, str], str] = {}
    meshes: dict[int, int | None] = {}
    room = TextureRoom()
    instancers: set[bpy.types.Object] = set()
    faceless: list[bpy.types.Object] = []
    volumes: set[str] = set()
    for instance in mesh.rendered_instances(depsgraph, read):
        if instance.is_instance:
            instancers.add(instance.instancer)
        data = instance.original.data
        if isinstance(data, bpy.types.Light):
            if instance.original.visible_camera:
                read.warn(f"Light '{instance.original.name}': the camera does not see lamps")
            lamps.append((data, instance.matrix))
            continue
        mesh.warn_of_object(instance.original, read)
        not_rendered.judge_camera_nodes(instance.original, read)
        if instance.object.type == "MESH":
            if not _read_object(instance, meshes, names, room, read):
                faceless.append(instance.original)
        elif instance.object.type == "VOLUME":
            _read_volume(scene, instance, volumes, read)
    for item in faceless:
        if item not in instancers:
            read.warn(f"Object '{item.name}': its mesh has no faces, so it renders as nothing")
    _note(read, [], room.warnings)
    read.bodies = judge_bodies(read)
    if not read.objects:
        cure = "add an object or make one visible for rendering"
        read.problems.append(
            Problem(f"Scene '{scene.name}'", "nothing with faces is rendered", cure)
        )
    world_values, owner, problems, warnings = world.read_world(scene.world)
    read.world = world_values
    _note(read, problems, warnings)
    if owner is not None:
        read.owners[owner.name] = owner
    for light, matrix in lamps:
        _read_lamp(light, matrix, read)
    _warn_of_render_settings(scene, read)


def _millimetres(scene: bpy.types.Scene) -> float | None:
    """Length of a Blender unit, None without a system of units."""
    units = scene.unit_settings
    return 1000 * float(units.scale_length) if units.system != "NONE" else None


def _note(read: SceneValues, problems: list[Problem], warnings: list[str]) -> None:
    read.problems.extend(item for item in problems if item not in read.problems)
    for text in warnings:
        read.warn(text)


def _read_cameras(
    scene: bpy.types.Scene,
    found: dict[str, bpy.types.Object],
    depsgraph: bpy.types.Depsgraph,
    read: SceneValues,
) -> None:
    for name, item in found.items():
        evaluated = item.evaluated_get(depsgraph)
        reason = cameras.why_unusable(evaluated)
        if reason:
            read.unusable_cameras[name] = reason
            read.warn(f"Camera '{name}' is left out: {reason}")
            continue
        read.cameras.append(cameras.read_camera(evaluated, name, scene))
        if item.data.dof.use_dof:
            read.warn(f"Camera '{name}': depth of field is not modelled")
    if not found:
        cure = "add a camera that stands where the photo was taken"
        read.problems.append(Problem(f"Scene '{scene.name}'", "it has no camera", cure))
    elif not read.cameras:
        cure = "make it perspective or orthographic"
        read.problems.extend(
            Problem(f"Camera '{name}'", reason, cure)
            for name, reason in read.unusable_cameras.items()
        )


def _read_object(
    instance: mesh.Instance,
    meshes: dict[int, int | None],
    names: dict[tuple[str, str], str],
    room: TextureRoom,
    read: SceneValues,
) -> bool:
    """False where there are no faces, and should be some."""
    evaluated = instance.object
    key = evaluated.data.as_pointer()
    title = f"Object '{instance.original.name}'"
    if key not in meshes:
        values = mesh.read_mesh(evaluated, read)
        meshes[key] = None if values is None else len(read.meshes)
        if values is not None:
            read.meshes.append(values)
    index = meshes[key]
    if index is None:
        return not_rendered.is_wire(evaluated)
    if not np.isfinite(instance.matrix).all() or np.linalg.det(instance.matrix[:3, :3]) == 0:
        read.warn(f"{title} is flattened to nothing by its scale and left out")
        return True
    used = set(np.unique(read.meshes[index].material_slots).tolist())
    slots = [slot.material for slot in evaluated.material_slots] or [None]
    visible = instance.original.visible_camera
    found = tuple(
        _material_name(material if slot in used else None, names, room, read)
        for slot, material in enumerate(slots)
    )
    for name in {found[slot] for slot in used}:
        _judge_attributes(title, read.meshes[index], name, read)
    read.objects.append(
        ObjectValues(
            name=instance.original.name,
            mesh=index,
            matrix=instance.matrix,
            materials=found,
            visible_to_camera=bool(visible),
        )
    )
    return True


def _read_volume(
    scene: bpy.types.Scene, instance: mesh.Instance, seen: set[str], read: SceneValues
) -> None:
    """A Volume object: a box of its own, and a material of its own, since grids have a place."""
    item = instance.original
    title = f"Object '{item.name}'"
    slot = next((slot.material for slot in instance.object.material_slots if slot.material), None)
    if slot is None:
        read.warn(f"{title} has no material and is left out")
        return
    if item.name in seen:
        cause = "its volume is there more than once"
        read.problems.append(Problem(title, cause, "make its instances real"))
        return
    seen.add(item.name)
    render = scene.render
    if render.use_simplify and render.simplify_volumes < 1:
        cause = f"Simplify renders it at {render.simplify_volumes:g} of its resolution"
        read.problems.append(Problem(title, cause, "set Volume Resolution of Simplify to 1"))
        return
    name = _free_name(slot.original.name, item.name, read)
    try:
        found = volume_objects.read(instance, slot.original, name)
    except Unreadable as error:
        read.problems.append(error.problem)
        return
    _note(read, [], found.warnings)
    read.meshes.append(found.mesh)
    read.materials.append(found.material)
    read.owners[name] = found.owner
    index, visible = len(read.meshes) - 1, bool(item.visible_camera)
    read.objects.append(ObjectValues(item.name, index, instance.matrix, (name,), visible))


def _judge_attributes(title: str, shape: MeshValues, material: str, read: SceneValues) -> None:
    """Whether a mesh has the UV maps and colour attributes that a material of it looks up."""
    values = next(item for item in read.materials if item.name == material)
    for found in values.maps.values():
        kind = "UV map" if found.texture is not None else "colour attribute"
        lists = shape.uv_maps if found.texture is not None else shape.colors
        names = [name for name, _ in lists]
        name = found.attribute
        if name in names or (names and not name) or not found.uv[:, :2].any():
            continue
        called = f"{kind} '{name}'" if name else kind
        asks = f"it has no {called}, which material '{material}' asks for"
        known = {*shape.other_attributes, *(item[0] for item in shape.uv_maps + shape.colors)}
        if name and name in known:
            cause = f"{asks}, but another kind of attribute of that name"
            cure = f"name a {kind} in the material's node, or add one"
            problem = Problem(title, cause, cure)
            if problem not in read.problems:
                read.problems.append(problem)
        else:
            read.warn(f"{title}: {asks}; it is taken as 0, as in Cycles")


def _material_name(
    evaluated: bpy.types.Material | None,
    names: dict[tuple[str, str], str],
    room: TextureRoom,
    read: SceneValues,
) -> str:
    """Reads a material once and returns the name under which the native scene knows it."""
    if evaluated is None:
        if materials.NO_MATERIAL not in {item.name for item in read.materials}:
            read.materials.append(materials.grey_material(materials.NO_MATERIAL))
        return materials.NO_MATERIAL
    material = evaluated.original
    library = material.library.filepath if material.library is not None else ""
    key = (material.name, library)
    if key not in names:
        names[key] = _free_name(material.name, library, read)
        result = materials.read_material(material, names[key], room)
        read.materials.append(result.values)
        read.owners[names[key]] = result.owner
        _note(read, result.problems, result.warnings)
    return names[key]


def _read_lamp(light: bpy.types.Light, matrix: np.ndarray, read: SceneValues) -> None:
    if lights.is_portal(light):
        read.warn(f"Light '{light.name}' is a portal, which is not needed")
        return
    name = _free_name(light.name, "light", read)
    if name != light.name:
        read.warn(f"Light '{light.name}' shares its name with another owner; it is called '{name}'")
    values, owner, problems, warnings = lights.read_light(light, matrix, name)
    read.lights.append(values)
    read.owners[name] = owner
    _note(read, problems, warnings)


def _free_name(name: str, distinction: str, read: SceneValues) -> str:
    """`name`, or with a distinction in brackets where another owner is called the same."""
    taken = {world.WORLD, *read.owners}
    candidates = [name, f"{name} ({distinction})" if distinction else f"{name} (local)"]
    candidates += [f"{candidates[1]} {number}" for number in range(2, len(taken) + 3)]
    return next(candidate for candidate in candidates if candidate not in taken)


def _warn_of_render_settings(scene: bpy.types.Scene, read: SceneValues) -> None:
    """Settings with which Cycles renders something else than full, unclamped light transport."""
    if abs(getattr(scene.cycles, "film_exposure", 1.0) - 1.0) > 1e-6:
        read.warn(f"Scene '{scene.name}': the film exposure of Cycles is taken as 1")
    if scene.render.use_motion_blur:
        read.warn(f"Scene '{scene.name}': motion blur is not modelled")
    if scene.render.use_border:
        read.warn(f"Scene '{scene.name}': the render border is ignored")
