# SPDX-License-Identifier: GPL-3.0-or-later
"""Scale, ground and repair of an imported reconstruction, and the sub-panel with their buttons."""

import math
from abc import abstractmethod

import bpy
import numpy as np
from bpy.props import FloatProperty

from ... import mean_free_path
from ...importers import imported, mesh_repair
from ...messages import message
from ...problems import BadInput, Problem
from ...scene_read.shading import volumes
from ...scene_read.shading.nodes import Unreadable
from ..problem_reports import report_problems
from ..texts import announce, paragraph
from .operators import meters_in_unit

#: What the last tool has found, by the scene's name: lines of the sub-panel.
FOUND: dict[str, list[str]] = {}


class _Tool(bpy.types.Operator):
    """Base: reports what it has found, or why it did nothing."""

    def execute(self, context: bpy.types.Context) -> set[str]:
        """One undo step."""
        try:
            lines = self._done(context)
        except BadInput as error:
            report_problems(self, error)
            return {"CANCELLED"}
        FOUND[context.scene.name] = lines
        announce(self, {"INFO"}, "; ".join(lines))
        return {"FINISHED"}

    @abstractmethod
    def _done(self, context: bpy.types.Context) -> list[str]:
        """What was found or changed. Raises BadInput."""


class SELENITE_OT_measure(_Tool):
    """Size of the reconstruction in metres, whether the active mesh is closed, its volume, and how
    far light goes in the media of its materials"""

    bl_idname = "selenite.measure"
    bl_label = "Measure"

    def _done(self, context: bpy.types.Context) -> list[str]:
        unit = meters_in_unit(context.scene)
        lines = []
        if any(imported.is_import(one) for one in context.scene.collection.children_recursive):
            collection = imported.collection_of(context.scene, context.active_object)
            lines.append(f"{collection.name}: {_box(imported.size_of(collection) * unit)}")
        item = context.active_object
        if item is not None and item.type == "MESH":
            _sync(item)
            lines += [f"{item.name}: {_box(mesh_repair.sides(item) * unit)}"]
            lines = list(dict.fromkeys(lines))  # an import of one mesh has its name and size
            lines.append(f"{item.name} is {mesh_repair.state_of(item).text(unit)}")
            lines += _media(item, unit, float(mesh_repair.sides(item).min()))
        if not lines:
            cure = "make a mesh the active object, or import a reconstruction"
            raise BadInput(Problem("Measure", "there is nothing to measure", cure))
        return lines


class SELENITE_OT_set_scale(_Tool):
    """Scale the whole reconstruction so that two selected vertices, or two selected objects, are so
    far apart"""

    bl_idname = "selenite.set_scale"
    bl_label = "Set Scale"
    bl_options = {"REGISTER", "UNDO"}

    length: FloatProperty(
        name="Metres", default=0.1, min=1e-6, soft_max=100.0, precision=5, description="Apart"
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Asks for the length."""
        return set(context.window_manager.invoke_props_dialog(self))

    def _done(self, context: bpy.types.Context) -> list[str]:
        unit = meters_in_unit(context.scene)
        collection = imported.collection_of(context.scene, context.active_object)
        points = imported.picked_points(context, 2)
        factor = imported.scale_to(collection, points, self.length / unit)
        context.view_layer.update()
        size = _box(imported.size_of(collection) * unit)
        lines = [
            message(
                "tools.times-as-large",
                "{name} is {factor} times as large: {size}",
                name=collection.name,
                factor=f"{factor:.6g}",
                size=size,
            )
        ]
        item = context.active_object
        if item is not None and item.type == "MESH":
            lines += _media(item, unit, float(mesh_repair.sides(item).min()))
        return lines


class SELENITE_OT_set_ground(_Tool):
    """Turn the whole reconstruction so that three selected vertices, or three selected objects, lie
    at z = 0, with the cameras above"""

    bl_idname = "selenite.set_ground"
    bl_label = "Set Ground"
    bl_options = {"REGISTER", "UNDO"}

    def _done(self, context: bpy.types.Context) -> list[str]:
        collection = imported.collection_of(context.scene, context.active_object)
        angle = imported.level_to(collection, imported.picked_points(context, 3))
        return [
            message(
                "tools.turned-ground-at-z",
                "{name} is turned by {degrees}°; ground at z = 0",
                name=collection.name,
                degrees=f"{math.degrees(angle):.3g}",
            )
        ]


class _MeshTool(_Tool):
    """Base of what changes or measures the active mesh."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """A mesh is active, in Object Mode."""
        cls.poll_message_set("Make a mesh the active object, in Object Mode")
        item = context.active_object
        return item is not None and item.type == "MESH" and item.mode == "OBJECT"


class SELENITE_OT_fill_holes(_MeshTool):
    """Close every hole of the active mesh by triangles and turn all faces outwards. Shape and UVs
    elsewhere stay"""

    bl_idname = "selenite.fill_holes"
    bl_label = "Fill Holes"
    bl_options = {"REGISTER", "UNDO"}

    def _done(self, context: bpy.types.Context) -> list[str]:
        item, unit = context.active_object, meters_in_unit(context.scene)
        before = mesh_repair.state_of(item)
        count = mesh_repair.fill_holes(item)
        after = mesh_repair.state_of(item)
        return [
            message(
                "tools.new-triangles-over-open",
                "{name}: {count} new triangles over {open_edges} open edges",
                name=item.name,
                count=count,
                open_edges=before.found.open_edges,
            ),
            message("tools.it-is", "it is {text}", text=after.text(unit)),
        ]


class SELENITE_OT_remesh(_MeshTool):
    """Replace the active mesh by one closed surface (Blender's voxel remesh). UV maps, and details
    smaller than a voxel, are lost"""

    bl_idname = "selenite.remesh"
    bl_label = "Watertight Remesh"
    bl_options = {"REGISTER", "UNDO"}

    voxels: FloatProperty(
        name="Voxels",
        default=200.0,
        min=4.0,
        max=mesh_repair.MOST_VOXELS,
        precision=0,
        description="Along the longest side: details of that size stay",
    )

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Asks for the resolution."""
        return set(context.window_manager.invoke_props_dialog(self))

    def _done(self, context: bpy.types.Context) -> list[str]:
        item, unit = context.active_object, meters_in_unit(context.scene)
        before, maps = mesh_repair.state_of(item), len(item.data.uv_layers)
        slots = {polygon.material_index for polygon in item.data.polygons}
        voxel = float(mesh_repair.sides(item).max()) / self.voxels
        mesh_repair.remesh(item, voxel)
        _sync(item)
        after = mesh_repair.state_of(item)
        lines = [
            f"{item.name} was {before.text(unit)}",
            message(
                "tools.voxel-mm",
                "it is {text}; a voxel has {voxel} mm",
                text=after.text(unit),
                voxel=f"{voxel * unit * 1000:.4g}",
            ),
        ]
        if maps:
            lines.append("its UV map is lost: unwrap it again before a texture is fitted")
        if len(slots) > 1:
            lines.append(
                message(
                    "tools.all-faces-material-now",
                    "all its faces have the material '{name}' now",
                    name=item.material_slots[0].name,
                )
            )
        return lines


class SELENITE_OT_thickness(_MeshTool):
    """Thickness of the active mesh below the 3D cursor: from the nearest point of its surface
    straight through"""

    bl_idname = "selenite.thickness"
    bl_label = "Thickness at Cursor"

    def _done(self, context: bpy.types.Context) -> list[str]:
        item, unit = context.active_object, meters_in_unit(context.scene)
        thickness = mesh_repair.thickness_at(item, np.array(context.scene.cursor.location))
        lines = [
            message(
                "tools.mm-thick-there",
                "{name} is {thickness} mm thick there",
                name=item.name,
                thickness=f"{thickness * unit * 1000:.4g}",
            )
        ]
        return lines + _media(item, unit, thickness)


class SELENITE_PT_reconstruction(bpy.types.Panel):
    """Scale, ground and closed meshes of an imported reconstruction"""

    bl_idname = "SELENITE_PT_reconstruction"
    bl_label = "Reconstruction"
    bl_parent_id = "SELENITE_PT_captures"
    bl_options = {"DEFAULT_CLOSED"}
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "Selenite"

    def draw(self, context: bpy.types.Context) -> None:
        """Scale, ground, repair; what the last of them found."""
        layout = self.layout
        layout.operator("selenite.measure", icon="DRIVER_DISTANCE")
        row = layout.row(align=True)
        row.operator("selenite.set_scale", icon="FULLSCREEN_ENTER")
        row.operator("selenite.set_ground", icon="ORIENTATION_NORMAL")
        column = layout.column(align=True)
        column.operator("selenite.fill_holes", icon="MESH_GRID")
        column.operator("selenite.remesh", icon="MOD_REMESH")
        column.operator("selenite.thickness", icon="PIVOT_CURSOR")
        lines = layout.column(align=True)
        for text in FOUND.get(context.scene.name, ()):
            paragraph(lines, context, text)


def _sync(item: bpy.types.Object) -> None:
    """What Edit Mode has changed, and new bounds."""
    if item.mode == "EDIT":
        item.update_from_editmode()
    bpy.context.view_layer.update()


def _box(sides: np.ndarray) -> str:
    return f"{' x '.join(f'{side:.4g}' for side in sides)} m"


def _media(item: bpy.types.Object, unit: float, thickness: float) -> list[str]:
    """How far light goes in the medium of each material, beside a thickness in Blender units."""
    lines = []
    for slot in item.material_slots:
        material = slot.material
        source = volumes.find_node(material)[0] if material is not None else None
        if source is None:
            continue
        try:
            extinction = volumes.read(source, material.name)["extinction"]
        except Unreadable:
            continue
        path = mean_free_path.of(extinction, 1000 * unit)
        line = message(
            "tools.mean-free-path",
            "mean free path in {name}: {text}",
            name=material.name,
            text=path.text(),
        )
        if max(extinction) > 0:
            line += message(
                "tools.mm",
                "; {thickness} mm are {lengths} of it",
                thickness=f"{thickness * unit * 1000:.4g}",
                lengths=f"{thickness * max(extinction):.3g}",
            )
        lines.append(line)
    return lines


CLASSES = (
    SELENITE_OT_measure,
    SELENITE_OT_set_scale,
    SELENITE_OT_set_ground,
    SELENITE_OT_fill_holes,
    SELENITE_OT_remesh,
    SELENITE_OT_thickness,
    SELENITE_PT_reconstruction,
)
