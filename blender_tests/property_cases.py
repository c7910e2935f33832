# SPDX-License-Identifier: GPL-3.0-or-later
"""For each row of the table of Blender's properties a value that has to be named.

Neither pytest nor the native modules are needed, so that `./dev bench hosts` runs the same cases in
every Blender.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import made_scenes as made
from property_scenes import scene_of_everything, scope

from selenite.scene_read import hosts
from selenite.scene_read.properties.inputs import INPUTS
from selenite.scene_read.properties.judge import Finding, Place, findings, places
from selenite.scene_read.properties.rows import Effect, OneOf, Row
from selenite.scene_read.properties.tables import TABLES, chain_of, struct_of

NAMED = (Effect.REFUSED, Effect.WARNED)


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
    value = node.inputs[name].default_value
    node.inputs[name].default_value = True if isinstance(value, bool) else 0.5


def _nothing() -> None:
    pass


def _volume_steps(value: int) -> Callable[[Any, Case], None]:
    return lambda block, case: setattr(block, case.name, value)


def _simplify() -> None:
    bpy.context.scene.render.use_simplify = True


def _region() -> None:
    bpy.context.scene.render.use_border = True


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


def _alpha_of_opaque_file() -> None:
    path = Path(bpy.app.tempdir) / "opaque.png"
    drawn = bpy.data.images.new("Drawn", 4, 4)
    drawn.filepath_raw, drawn.file_format = str(path), "PNG"
    drawn.save()
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(path))
    material.node_tree.links.new(node.outputs["Alpha"], made.principled(material).inputs["Alpha"])


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
    "CyclesRenderSettings.shading_system": _alpha_of_opaque_file,
    "CyclesRenderSettings.texture_limit_render": _simplify,
    "CyclesRenderSettings.texture_resolution_render": _simplify,
    "RenderSettings.use_crop_to_border": _region,
    "RenderSettings.simplify_volumes": _simplify,
    "CyclesObjectSettings.use_camera_cull": _cull("use_camera_cull"),
    "CyclesObjectSettings.use_distance_cull": _cull("use_distance_cull"),
    "CyclesObjectSettings.use_adaptive_subdivision": _experimental,
    "CyclesLightSettings.is_caustics_light": _caustics,
    "CyclesWorldSettings.is_caustics_light": _caustics,
    "ShaderNodeBsdfPrincipled.subsurface_method": _subsurface,
}
#: How it is set, where another value of the property does not say it
SET: dict[str, Callable[[Any, Case], None]] = {
    "RenderSettings.simplify_volumes": _volume_steps(0),
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
if not bpy.app.build_options.cycles_osl:
    COVERED.add("CyclesRenderSettings.shading_system")  # without effect, as in Debian's Blender
if "shadow_terminator_shading_offset" in bpy.types.Object.bl_rna.properties:
    COVERED.add("CyclesObjectSettings.shadow_terminator_offset")  # left over, without effect


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
