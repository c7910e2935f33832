# SPDX-License-Identifier: GPL-3.0-or-later
"""The whole scene, read in one pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import bpy
import numpy as np

from .. import parameters
from ..messages import remark, thing
from ..problems import Problem
from . import camera as cameras
from . import hosts, linking, properties, view_layers, visibility, volume_objects, working_space
from .baking.approximated import ComparisonAsked
from .baking.baked import BakeAsked
from .baking.wanted import Baker
from .blender_process import is_copy
from .geometry import mesh, not_rendered, shading_data
from .geometry.bodies import judge_bodies
from .lamps import lights
from .lamps.frames import LampFrames
from .options import ReadingOptions, options_of
from .reading.render_depsgraph import GraphRead, Reading, at_once, remarks, view_layer_of
from .shading import materials, world
from .shading.graph.surface import closure_rows
from .shading.nodes import Unreadable
from .shading.textures import TextureRoom
from .values import ALL_SETS, ObjectValues, SceneValues


def read_scene(
    scene: bpy.types.Scene,
    *,
    surveys: bool = True,
    bakes: bool = True,
    options: ReadingOptions | None = None,
    note: Callable[[str], None] | None = None,
) -> SceneValues:
    """Reads everything that Cycles would render; changes nothing. See `reading`.

    surveys: False leaves out whether bodies are closed, the longest part that needs no Blender:
    `judge_bodies` may follow in another thread. note: is told how far a bake is.
    """
    read = at_once(reading(scene, bakes=bakes, options=options), note)
    if surveys:
        read.bodies = judge_bodies(read)
    return read


def reading(
    scene: bpy.types.Scene, *, bakes: bool = True, options: ReadingOptions | None = None
) -> Reading[SceneValues]:
    """Everything that Cycles would render, but not whether bodies are closed.

    options: None: those of the scene. bakes: False leaves images that are to be baked empty:
    nothing is rendered of it. What cannot be rendered is in `problems`, what is rendered
    differently in `warnings`. Raises NativeUnavailable, since the parameter table is native.
    """
    options = options_of(scene) if options is None else options
    read = SceneValues(millimetres=millimetres(scene), approximate=options.approximate)
    width, height = cameras.resolution(scene)
    if min(width, height) < 1:
        cause = f"a render has {width} x {height} pixels"
        cure = "raise the resolution or its percentage"
        read.problems.append(Problem(thing("Scene", scene.name), cause, cure))
    read.problems += working_space.problems(scene)
    found = cameras.named_cameras(scene)
    layer = view_layer_of(scene)
    rendered: list[bpy.types.Object] = []
    room = TextureRoom(
        baker=Baker() if options.bake else None,
        approximations=[] if options.approximate else None,
    )
    background = world.evaluate(scene, view_layers.world_of(scene, layer))
    problem = yield GraphRead(
        scene,
        list(found.values()),
        lambda depsgraph, check: rendered.extend(
            _read(scene, layer, found, background, depsgraph, check, room, read)
        ),
    )
    if problem is not None:
        read.problems.append(problem)
    # Settings of the scene are its own again.
    _judge_properties(scene, layer, rendered, read)
    _note(read, [], list(remarks(scene)))
    if room.baker is not None and room.baker.materials:
        _note(read, room.baker.problems(), [])
        if bakes and not read.problems:
            problem = yield BakeAsked(scene, room.baker, read)
            _note(read, [] if problem is None else [problem], [])
    if room.approximations:
        _note(read, [], room.approximations)
        if bakes and not read.problems and not is_copy():
            yield ComparisonAsked(scene, options, room.approximations, read)
    read.lamp_frames = LampFrames(scene, read)
    return read


def _read(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    found_cameras: dict[str, bpy.types.Object],
    background: world.Evaluated,
    depsgraph: bpy.types.Depsgraph,
    check: Callable[[], None],
    room: TextureRoom,
    read: SceneValues,
) -> list[bpy.types.Object]:
    """Fills `read`; returns the original objects that render."""
    cameras.read_cameras(scene, found_cameras, depsgraph, read)
    # Lamps come last: where names clash, the material keeps the plain name.
    lamps: list[mesh.Instance] = []
    names: dict[tuple[str, str], str] = {}
    meshes: dict[int, int | None] = {}
    instancers: set[bpy.types.Object] = set()
    faceless: list[bpy.types.Object] = []
    evaluated = [item.original for item in depsgraph.ids if isinstance(item, bpy.types.Object)]
    links = linking.light_and_shadow_linking(evaluated, read.problems)
    rendered: list[bpy.types.Object] = []
    volumes: set[str] = set()
    for instance in mesh.rendered_instances(depsgraph, read):
        check()
        if isinstance(instance.object.data, (bpy.types.Light, bpy.types.Mesh, bpy.types.Volume)):
            rendered.append(instance.original)  # and no curve without a surface
        if instance.is_instance:
            instancers.add(instance.instancer)
        data = instance.original.data
        if isinstance(data, bpy.types.Light):
            lamps.append(instance)
            continue
        not_rendered.judge_camera_nodes(instance.original, read)
        if instance.object.type == "MESH":
            if not _read_object(instance, layer, links, meshes, names, room, check, read):
                faceless.append(instance.original)
        elif instance.object.type == "VOLUME":
            _read_volume(instance, layer, links, volumes, read)
    for item in faceless:
        if item not in instancers:
            read.warn(
                remark(
                    thing("Object", item.name), "its mesh has no faces, so it renders as nothing"
                )
            )
    _note(read, [], room.warnings)
    if not read.objects:
        cure = "add an object or make one visible for rendering"
        read.problems.append(
            Problem(thing("Scene", scene.name), "nothing with faces is rendered", cure)
        )
    rendered_world = view_layers.world_of(scene, layer)
    world_values, owner, problems, warnings = world.read_world(rendered_world, background)
    read.world = visibility.of_world(world_values, rendered_world, scene)
    _note(read, problems, warnings)
    if owner is not None:
        read.owners[owner.name] = owner
    called: dict[tuple[str, str], str] = {}
    for lamp in lamps:
        _read_lamp(lamp, layer, links, called, read)
    _note(read, [], visibility.warnings(read))
    return rendered


def millimetres(scene: bpy.types.Scene) -> float | None:
    """Length of a Blender unit, None without a system of units."""
    units = scene.unit_settings
    return 1000 * float(units.scale_length) if units.system != "NONE" else None


def _note(read: SceneValues, problems: list[Problem], warnings: list[str]) -> None:
    read.problems.extend(item for item in problems if item not in read.problems)
    for text in warnings:
        read.warn(text)


def _read_object(
    instance: mesh.Instance,
    layer: bpy.types.ViewLayer,
    links: tuple[linking.Linking, linking.Linking],
    meshes: dict[int, int | None],
    names: dict[tuple[str, str], str],
    room: TextureRoom,
    check: Callable[[], None],
    read: SceneValues,
) -> bool:
    """False where there are no faces, and should be some."""
    evaluated = instance.object
    key = evaluated.data.as_pointer()
    title = thing("Object", instance.original.name)
    if key not in meshes:
        values = mesh.read_mesh(evaluated, check, read)
        meshes[key] = None if values is None else len(read.meshes)
        if values is not None:
            read.meshes.append(values)
    index = meshes[key]
    if index is None:
        return not_rendered.is_wire(evaluated)
    if not np.isfinite(instance.matrix).all():
        cause, cure = "its matrix holds an infinite number or none", "clear its transformation"
        read.problems.append(Problem(title, cause, cure))
        return True
    if np.linalg.det(instance.matrix[:3, :3]) == 0:
        found_flat = mesh.unflattened(instance, read.meshes[index].positions)
        if found_flat is None:
            read.warn(remark(title, "is flattened to nothing by its scale and left out", " "))
            return True
        instance = found_flat
    used = set(np.unique(read.meshes[index].material_slots).tolist())
    slots = [slot.material for slot in evaluated.material_slots] or [None]
    if layer.material_override is not None:
        slots = [layer.material_override] * len(slots)
    found = tuple(
        _material_name(material if slot in used else None, names, room, read)
        for slot, material in enumerate(slots)
    )
    for name in {found[slot] for slot in used}:
        shading_data.add_vectors(evaluated, index, name, read)
        shading_data.judge_attributes(title, read.meshes[index], name, read)
    _add_object(instance, layer, links, index, found, read)
    if room.baker is not None and read.objects and read.objects[-1].materials is found:
        place = len(read.objects) - 1
        room.baker.used(instance.original, place, found, is_instance=instance.is_instance)
    return True


def _add_object(
    instance: mesh.Instance,
    layer: bpy.types.ViewLayer,
    links: tuple[linking.Linking, linking.Linking],
    index: int,
    found: tuple[str, ...],
    read: SceneValues,
) -> None:
    """An object with the mesh and the materials that were read, unless no ray sees it."""
    item, instancer = instance.original, instance.instancer
    visible_to = visibility.rays_that_see(item, instancer, layer)
    if not visible_to:
        return
    light, shadow = links
    if shadow.bits_of(item) != ALL_SETS and _shines(found, read):
        read.warn(
            remark(
                thing("Object", item.name),
                "its blocker collection is not modelled, since a surface emits the "
                "light and no lamp; everything casts its shadows: clear the collection",
            )
        )
    read.objects.append(
        ObjectValues(
            name=item.name,
            mesh=index,
            matrix=instance.matrix,
            materials=found,
            visible_to=visible_to,
            holdout=visibility.is_holdout(instancer, layer),
            lit_set=light.set_of(item, instancer),
            shadow_set=shadow.set_of(item, instancer),
            lit=light.bits_of(item),
            facts=shading_data.facts(instance),
        )
    )


def _shines(names: tuple[str, ...], read: SceneValues) -> bool:
    """Whether one of these materials emits light."""
    return any(
        (item.shader is not None and item.shader.emits())
        or "emission_strength" in item.maps
        or any(item.values.get("emission_strength", ()))
        for item in read.materials
        if item.name in names
    )


def _read_volume(
    instance: mesh.Instance,
    layer: bpy.types.ViewLayer,
    links: tuple[linking.Linking, linking.Linking],
    seen: set[str],
    read: SceneValues,
) -> None:
    """A Volume object: a box of its own, and a material of its own, since grids have a place."""
    item = instance.original
    title = thing("Object", item.name)
    slot = layer.material_override or next(
        (slot.material for slot in instance.object.material_slots if slot.material), None
    )
    if slot is None:
        read.warn(remark(title, "has no material and is left out", " "))
        return
    if item.name in seen:
        cause = "its volume is there more than once"
        read.problems.append(Problem(title, cause, "make its instances real"))
        return
    seen.add(item.name)
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
    _add_object(instance, layer, links, len(read.meshes) - 1, (name,), read)


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


def _read_lamp(
    lamp: mesh.Instance,
    layer: bpy.types.ViewLayer,
    links: tuple[linking.Linking, linking.Linking],
    called: dict[tuple[str, str], str],
    read: SceneValues,
) -> None:
    """A lamp at one place. One that stands at several is several lights of one owner."""
    light = lamp.original.data
    assert isinstance(light, bpy.types.Light), light
    if lights.is_portal(light):
        read.warn(remark(thing("Light", light.name), "is a portal, which is not needed", " "))
        return
    if lights.is_line(light):
        text = "has a side of 0, with which Cycles shows no light, and is left out; enlarge it"
        read.warn(remark(thing("Light", light.name), text, " "))
        return
    key = (light.name, light.library.filepath if light.library is not None else "")
    name = called.get(key) or _free_name(light.name, "light", read)
    if name != light.name:
        read.warn(
            remark(
                thing("Light", light.name),
                f"shares its name with another owner; it is called '{name}'",
                " ",
            )
        )
    called[key] = name
    values, owner, problems, otherwise = lights.read_light(light, lamp.matrix, name)
    rays = visibility.rays_that_see(lamp.original, lamp.instancer, layer)
    values = visibility.of_lamp(values, light, rays)
    lit, shading = (kind.bits_of(lamp.original) for kind in links)
    read.lights.append(replace(values, object=lamp.original.name, lit=lit, shading=shading))
    read.owners[name] = owner
    _note(read, problems, [])
    for problem in otherwise:
        read.refuse(problem)


def _free_name(name: str, distinction: str, read: SceneValues) -> str:
    """`name`, or with a distinction in brackets where another owner is called the same."""
    taken = {world.WORLD, *read.owners}
    candidates = [name, f"{name} ({distinction})" if distinction else f"{name} (local)"]
    candidates += [f"{candidates[1]} {number}" for number in range(2, len(taken) + 3)]
    return next(candidate for candidate in candidates if candidate not in taken)


def _judge_properties(
    scene: bpy.types.Scene,
    layer: bpy.types.ViewLayer,
    rendered: Iterable[bpy.types.Object],
    read: SceneValues,
) -> None:
    """Names what the table of Blender's properties knows not to be modelled."""
    objects = tuple(dict.fromkeys(rendered))
    used: list[bpy.types.Material | None] = [
        bpy.data.materials.get((owner.datablock, owner.library or None))
        for owner in read.owners.values()
        if owner.kind == "material"
    ]
    scope = properties.Scope(
        scene=scene,
        view_layer=layer,
        objects=objects,
        instancers=properties.instancers_of(layer, objects),
        cameras=tuple(
            item
            for name, item in cameras.named_cameras(scene).items()
            if name not in read.unusable_cameras
        ),
        materials=tuple(item for item in used if item is not None),
        world=view_layers.world_of(scene, layer),
        has_grids=any(item.grids for item in read.materials),
    )
    known = {
        socket
        for parameter in (*parameters.of("material"), *closure_rows()["principled"])
        if hosts.node_version() in parameter.versions
        for socket in parameter.sockets
    }
    _note(read, *properties.judge(scope, frozenset(known)))
