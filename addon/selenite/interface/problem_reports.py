# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a request: in Blender's reports, and as a list that stays in the panel."""

from __future__ import annotations

import bpy
from bpy.props import StringProperty

from ..fit.job import FitFailed
from ..messages import named
from ..problems import BadInput, Problem
from ..scene_read.camera import named_cameras
from .state import PROBLEMS, SHAPES
from .texts import announce, shown


def report_problems(operator: bpy.types.Operator, error: BadInput | FitFailed) -> None:
    """All of them stay in the head of the panel; the report has a line for each."""
    PROBLEMS[bpy.context.scene.name] = list(error.problems)
    lines = (
        Problem(shown(item.object), shown(item.cause), shown(item.cure)).line()
        for item in error.problems
    )
    operator.report({"ERROR"}, "\n".join(lines))


def thing_of(kind: str, name: str) -> bpy.types.ID | None:
    """The datablock that a problem is about, as `messages.named` has it; None for none."""
    data = bpy.data
    if kind == "camera":
        return named_cameras(bpy.context.scene).get(name) or data.objects.get(name)
    if kind == "parameter":
        owner = name.rpartition(":")[0]
        return data.materials.get(owner) or data.lights.get(owner)
    places = {
        "object": data.objects, "material": data.materials, "light": data.lights,
        "mesh": data.meshes, "image": data.images,
    }  # fmt: skip
    return places[kind].get(name) if kind in places else None


class SELENITE_OT_select_problem(bpy.types.Operator):
    """Select the thing that the problem is about: an object, or what has the material, mesh or
    lamp"""

    bl_idname = "selenite.select_problem"
    bl_label = "Select"
    bl_options = {"REGISTER", "UNDO"}

    kind: StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="What the problem is about")
    name: StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Its name")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """All objects concerned, the first one active; a material becomes the active one."""
        thing = thing_of(self.kind, self.name)
        objects = [item for item in context.view_layer.objects if _uses(item, thing)]
        if thing is None or not objects:
            announce(self, {"WARNING"}, "Nothing in the view layer is or has it")
            return {"CANCELLED"}
        for item in context.view_layer.objects:
            if item.select_get():
                item.select_set(False)
        for item in objects:
            item.select_set(True)
        context.view_layer.objects.active = objects[0]
        for at, slot in enumerate(objects[0].material_slots):
            if slot.material == thing:
                objects[0].active_material_index = at
        return {"FINISHED"}


class SELENITE_OT_close_body(bpy.types.Operator):
    """Close every hole of the body's mesh by triangles and turn all faces outwards. Shape and UVs
    elsewhere stay"""

    bl_idname = "selenite.close_body"
    bl_label = "Fill Holes"
    bl_options = {"REGISTER", "UNDO"}

    name: StringProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Name of the object")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Of the object that the problem names, which becomes the active one."""
        item: bpy.types.Object | None = bpy.data.objects.get(self.name)
        objects = context.view_layer.objects
        if item is None or item.name not in objects:
            announce(self, {"WARNING"}, "Nothing in the view layer is or has it")
            return {"CANCELLED"}
        objects.active = item
        if bpy.ops.selenite.fill_holes() != {"FINISHED"}:
            return {"CANCELLED"}
        left = PROBLEMS.get(context.scene.name, [])
        PROBLEMS[context.scene.name] = [
            one for one in left if named(one.object) != ("object", self.name)
        ]
        SHAPES.pop(context.scene.name, None)
        return {"FINISHED"}


class SELENITE_OT_clear_problems(bpy.types.Operator):
    """Clear the list; what is still wrong comes back with the next start"""

    bl_idname = "selenite.clear_problems"
    bl_label = "Clear Problems"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Of this scene."""
        PROBLEMS.pop(context.scene.name, None)
        return {"FINISHED"}


def _uses(item: bpy.types.Object, thing: bpy.types.ID | None) -> bool:
    slots = [slot.material for slot in item.material_slots]
    return thing is not None and (thing in (item, item.data) or thing in slots)


CLASSES = (SELENITE_OT_select_problem, SELENITE_OT_close_body, SELENITE_OT_clear_problems)
