# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that has every kind of datablock, and for each row of the table a value to be named.

Neither pytest nor the native modules are needed, so that `./dev bench hosts` runs the same cases in
every Blender.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import bpy
import made_scenes as made
import numpy as np

from selenite.scene_read import hosts, properties
from selenite.scene_read.properties.inputs import INPUTS, LINKED_ONLY
from selenite.scene_read.properties.judge import Finding, Place, findings, places
from selenite.scene_read.properties.rows import Effect, OneOf, Row, same
from selenite.scene_read.properties.tables import (
    TABLES,
    chain_of,
    default_of,
    own_properties,
    struct_of,
    unknown_properties,
)

NAMED = (Effect.REFUSED, Effect.WARNED)


def scene_of_everything() -> None:
    """Objects of every type that is read, lamps of every type, images, a medium, a world."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    image = bpy.data.images.new("Picture", 4, 4)
    body = made.material(alpha=0.5, transmission=0.5)
    texture = body.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    made.link(body, texture.outputs["Color"])
    scatter = body.node_tree.nodes.new("ShaderNodeVolumeScatter")
    output = body.node_tree.get_output_node("CYCLES")
    body.node_tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    item = made.triangle(material=body)
    item.modifiers.new("Levels", "SUBSURF")
    inner = bpy.data.collections.new("Props")
    scene.collection.children.link(inner)
    curve = bpy.data.curves.new("Wire", "CURVE")
    inner.objects.link(bpy.data.objects.new("Wire", curve))
    made.add("Words", bpy.data.curves.new("Words", "FONT"))
    made.add("Drop", bpy.data.metaballs.new("Drop"))
    cloud = bpy.data.volumes.new("Cloud")
    cloud.materials.append(body)
    made.add("Cloud", cloud)
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        made.light(kind.title(), kind).visible_camera = False
    made.camera()
    sky = made.world()
    environment = sky.node_tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    background = next(n for n in sky.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    sky.node_tree.links.new(environment.outputs[0], background.inputs["Color"])


def scene_in_view() -> None:
    """The same, brought before the camera, so that each part has its share of a small picture."""
    scene_of_everything()
    scene = bpy.context.scene
    rng = np.random.default_rng(1)
    image = bpy.data.images["Picture"]
    image.pixels.foreach_set(rng.random(64).astype(np.float32))
    image.update()
    made.sphere("Ball", bpy.data.materials["Body"]).location = (1.2, 0.6, 0)
    mirror = made.material("Mirror", roughness=0.0)
    made.principled(mirror).inputs["Metallic"].default_value = 1.0
    wall = made.sphere("Wall", mirror)
    wall.location, wall.scale = (-1.3, 0.4, -0.2), (0.9, 0.9, 0.9)
    spline = bpy.data.curves["Wire"].splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, x in zip(spline.bezier_points, (-2, 2), strict=True):
        point.co, point.handle_left, point.handle_right = (x, -1.2, 0), (x, -2, 0), (x, -0.4, 0)
    bpy.data.curves["Wire"].bevel_depth = 0.1
    bpy.data.curves["Words"].extrude = 0.1
    bpy.data.metaballs["Drop"].elements.new().radius = 0.8
    scene.objects["Words"].location, scene.objects["Drop"].location = (-1, 1, 0.2), (0.2, -0.4, 0.5)
    bpy.data.objects.remove(scene.objects["Cloud"])
    places_of_lamps = {
        "Point": (2, 1, 2),
        "Spot": (-1, -1, 3),
        "Area": (0, 2, 2.5),
        "Sun": (0, 0, 4),
    }
    for name, place in places_of_lamps.items():
        lamp = scene.objects[name]
        lamp.location, lamp.visible_camera = place, False
        lamp.data.energy = 3.0 if name == "Sun" else 60.0
    bpy.data.lights["Point"].shadow_soft_size = bpy.data.lights["Spot"].shadow_soft_size = 0.3
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    bpy.context.view_layer.update()


def scope() -> properties.Scope:
    """The open scene as `read_scene` would see it, without a view of what is hidden."""
    scene = bpy.context.scene
    layer = bpy.context.view_layer
    objects = tuple(o for o in scene.objects if o.type not in {"CAMERA", "EMPTY"})
    materials = dict.fromkeys(
        slot.material for o in objects for slot in o.material_slots if slot.material is not None
    )
    return properties.Scope(
        scene=scene,
        view_layer=layer,
        objects=objects,
        instancers=properties.instancers_of(layer, objects),
        cameras=tuple(o for o in scene.objects if o.type == "CAMERA"),
        materials=tuple(materials),
        world=scene.world,
    )


@dataclass(frozen=True)
class Case:
    """A property (or an input) to which another value is given."""

    type: str
    name: str
    row: Row
    is_input: bool = False

    @property
    def id(self) -> str:
        """For the report."""
        return f"{self.type}{'.inputs' * self.is_input}.{self.name}"


def cases() -> list[Case]:
    """Every row that this package names and that this Blender has."""
    found = [
        Case(name, row.names[0], row)
        for name, item in TABLES.items()
        for row in item.named
        if row.effect in NAMED and _has(name, row.names[0])
    ]
    node = made.principled(made.material("Probe"))
    found += [
        Case(item.type, row.names[0], row, is_input=True)
        for item in INPUTS.values()
        for row in item.named
        if row.names[0] in node.inputs
    ]
    return [item for item in found if item.id not in COVERED]


def _has(type_name: str, name: str) -> bool:
    struct = struct_of(type_name)
    return struct is not None and name in struct.properties


def found_by(case: Case) -> tuple[Place, list[Finding]]:
    """Sets the case's value in a new scene of everything; where, and what is named that was not
    named before."""
    scene_of_everything()
    PREPARE.get(case.id, _nothing)()
    before = set(findings(scope()))
    if case.is_input:
        place = next(p for p in places(scope()) if p.block.bl_rna.identifier == case.type)
        _change_input(place.block, case.name)
    else:
        place = _place_of(case)
        SET.get(case.id, _change)(place.block, case)
    return place, [item for item in findings(scope()) if item not in before]


def _place_of(case: Case) -> Place:
    found = [
        place
        for place in places(scope())
        if any(struct.identifier == case.type for struct in chain_of(place.block.bl_rna))
    ]
    if found:  # the root of the collections is first, and keeps its flags
        return found[-1] if case.type == "LayerCollection" else found[0]
    raise LookupError(f"the scene of everything has no {case.type}")


def _change(block: Any, case: Case) -> None:  # noqa: ANN401
    """Gives a property a value that is not neutral."""
    shown = block.bl_rna.properties[case.name]
    old = getattr(block, case.name)
    if shown.type == "BOOLEAN":
        value: Any = not case.row.neutral
    elif shown.type == "ENUM":
        known = case.row.neutral
        neutral = known.values if isinstance(known, OneOf) else (known,)
        value = next(item.identifier for item in shown.enum_items if item.identifier not in neutral)
    elif shown.type == "POINTER":
        value = _datablock(shown.fixed_type.identifier)
    elif getattr(shown, "array_length", 0):
        value = [number + 0.5 for number in old]
    else:
        step = 2 if shown.hard_max >= old + 2 or shown.hard_min <= old - 2 else 0.5
        value = old + step if old + step <= shown.hard_max else old - step
    setattr(block, case.name, value)


def _datablock(kind: str) -> bpy.types.ID:
    makers: dict[str, Callable[[], bpy.types.ID]] = {
        "Scene": lambda: bpy.data.scenes.new("Other"),
        "Material": lambda: bpy.data.materials.new("Other"),
        "World": lambda: bpy.data.worlds.new("Other"),
        "Collection": lambda: bpy.data.collections.new("Other"),
    }
    return makers[kind]()


def _change_input(node: bpy.types.Node, name: str) -> None:
    if name in LINKED_ONLY:
        tree = node.id_data
        tree.links.new(tree.nodes.new("ShaderNodeNormalMap").outputs[0], node.inputs[name])
    else:
        value = node.inputs[name].default_value
        node.inputs[name].default_value = True if isinstance(value, bool) else 0.5


def _nothing() -> None:
    pass


def _volume_steps(value: int) -> Callable[[Any, Case], None]:
    return lambda block, case: setattr(block, case.name, value)


def _simplify() -> None:
    bpy.context.scene.render.use_simplify = True


def _cull(name: str) -> Callable[[], None]:
    def prepare() -> None:
        _simplify()
        setattr(bpy.context.scene.cycles, name, True)

    return prepare


def _caustics() -> None:
    flags = bpy.context.scene.objects["Body"].cycles
    flags.is_caustics_caster = flags.is_caustics_receiver = True


def _subsurface() -> None:
    inputs = made.principled(bpy.data.materials["Body"]).inputs
    name = "Subsurface Weight" if "Subsurface Weight" in inputs else "Subsurface"
    inputs[name].default_value = 0.5


def _compositor(scene: Any, case: Case) -> None:  # noqa: ANN401
    if case.name == "node_tree":
        scene.use_nodes = True
        tree = scene.node_tree
    else:
        tree = scene.compositing_node_group = bpy.data.node_groups.new("C", "CompositorNodeTree")
    tree.nodes.new("CompositorNodeExposure")


def _strips(scene: Any, _: Case) -> None:  # noqa: ANN401
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences
    strips.new_scene("Strip", scene, 1, 1)


def _other_layer(scene: Any, _: Case) -> None:  # noqa: ANN401
    scene.view_layers.new("Second")


def _light_linking(item: Any, _: Case) -> None:  # noqa: ANN401
    item.light_linking.receiver_collection = bpy.data.collections.new("Receivers")


def _experimental() -> None:
    bpy.context.scene.cycles.feature_set = "EXPERIMENTAL"


def _resolution(value: float) -> Callable[[Any, Case], None]:
    return lambda block, case: setattr(block, case.name, value)


def _smoke(modifier: Any, _: Case) -> None:  # noqa: ANN401
    item = modifier.id_data
    fluid = item.modifiers.new("Smoke", "FLUID")
    fluid.fluid_type = "DOMAIN"


#: What has to be so besides, for the property to act
PREPARE: dict[str, Callable[[], None]] = {
    "CyclesRenderSettings.texture_limit_render": _simplify,
    "CyclesRenderSettings.texture_resolution_render": _simplify,
    "CyclesObjectSettings.use_camera_cull": _cull("use_camera_cull"),
    "CyclesObjectSettings.use_distance_cull": _cull("use_distance_cull"),
    "CyclesObjectSettings.use_adaptive_subdivision": _experimental,
    "CyclesLightSettings.is_caustics_light": _caustics,
    "CyclesWorldSettings.is_caustics_light": _caustics,
    "ShaderNodeBsdfPrincipled.subsurface_method": _subsurface,
}
#: How it is set, where another value of the property does not say it
SET: dict[str, Callable[[Any, Case], None]] = {
    "Scene.node_tree": _compositor,
    "Scene.compositing_node_group": _compositor,
    "Scene.sequence_editor": _strips,
    "Scene.view_layers": _other_layer,
    "Object.light_linking": _light_linking,
    "Modifier.type": _smoke,
    "CyclesRenderSettings.volume_max_steps": _volume_steps(16),
    "CyclesRenderSettings.max_bounces": _volume_steps(2),
    "CyclesRenderSettings.diffuse_bounces": _volume_steps(2),
    "CyclesRenderSettings.glossy_bounces": _volume_steps(2),
    "CyclesRenderSettings.transmission_bounces": _volume_steps(2),
    "CyclesRenderSettings.transparent_max_bounces": _volume_steps(2),
    "CyclesLightSettings.max_bounces": _volume_steps(2),
    "CyclesWorldSettings.max_bounces": _volume_steps(2),
    "MetaBall.render_resolution": _resolution(0.05),
}
#: Named by a row of another type
COVERED = {"ObjectLightLinking.receiver_collection"}
if not hosts.is_version_3():  # both distributions are modelled
    COVERED.add("ShaderNodeBsdfPrincipled.distribution")


def is_named(case: Case, place: Place, found: Finding) -> bool:
    """Whether a finding is the one for a case: object, cause and cure."""
    start = case.row.cause.partition("{")[0]
    return (
        (place.kind, place.name) == (found.kind, found.name)
        and found.cause.startswith(start)
        and len(found.cause) > 10
        and len(found.cure) > 5
        and "{" not in found.cause + found.cure
    )


def unknown() -> list[str]:
    """What this Blender has and the table lacks: properties, inputs of nodes, types."""
    found = []
    for name in TABLES:
        struct = struct_of(name)
        if struct is not None:
            items = unknown_properties(struct)
            found += [f"{name}.{item.identifier} ({item.name})" for item in items]
    tree = bpy.data.materials.new("Probe")
    tree.use_nodes = True
    for name, item in INPUTS.items():
        if hasattr(bpy.types, name):
            node = tree.node_tree.nodes.new(name)
            found += [f"{name}.inputs.{s.name}" for s in node.inputs if s.name not in item.by_name]
    for base in ("Light", "Curve"):
        found += [
            f"type {name} (a kind of {base})"
            for name in dir(bpy.types)
            if name not in TABLES and _is_kind_of(name, base)
        ]
    return found + unknown_values()


def _is_kind_of(name: str, base: str) -> bool:
    struct = getattr(getattr(bpy.types, name), "bl_rna", None)
    return struct is not None and struct.base is not None and struct.base.identifier == base


def unknown_values() -> list[str]:
    """Values of modelled enumerations that the table lacks."""
    found = []
    for name, item in TABLES.items():
        struct = struct_of(name)
        for row in item.named if struct is not None else ():
            shown = struct.properties.get(row.names[0])
            if row.effect is Effect.MODELLED and shown is not None:
                known = row.neutral.values
                values = (value.identifier for value in shown.enum_items)
                found += [f"{name}.{row.names[0]} = {v}" for v in values if v not in known]
    return found


def different_defaults() -> list[str]:
    """Properties whose default in RNA is not the value of a fresh datablock."""
    scene_of_everything()
    found = {}
    for place in places(scope()):
        for struct in chain_of(place.block.bl_rna):
            if struct.identifier not in TABLES:
                continue
            for item in own_properties(struct):
                if item.type not in {"BOOLEAN", "INT", "FLOAT", "ENUM"} or item.is_readonly:
                    continue
                default = default_of(item)
                value = getattr(place.block, item.identifier)
                if not same(value, default):
                    key = f"{struct.identifier}.{item.identifier}"
                    found.setdefault(key, f"{key}: {default} in RNA, {value} in a new one"[:120])
    return list(found.values())


if (
    "shadow_terminator_shading_offset" in bpy.types.Object.bl_rna.properties
):  # that of Cycles is left over
    COVERED.add("CyclesObjectSettings.shadow_terminator_offset")


def counts() -> dict[str, dict[str, int]]:
    """Type -> class -> number of properties that this Blender has."""
    found: dict[str, dict[str, int]] = {}
    for name, item in TABLES.items():
        struct = struct_of(name)
        if struct is None:
            continue
        inherited = set(struct.base.properties.keys()) if struct.base else set()
        own = set(struct.properties.keys()) - inherited
        for key in own & item.by_name.keys():
            row = found.setdefault(name, {})
            effect = item.by_name[key].effect.value
            row[effect] = row.get(effect, 0) + 1
    return found


def absent_rows() -> Iterator[str]:
    """Rows of the table that this Blender lacks."""
    for name, item in TABLES.items():
        struct = struct_of(name)
        known = struct.properties.keys() if struct is not None else ()
        yield from (f"{name}.{key}" for key in item.by_name if key not in known)
