# SPDX-License-Identifier: GPL-3.0-or-later
"""A reconstruction is imported in a real window: undo and redo, tools, and the sub-panel drawn."""

import bpy
from _driving import FOLDER, in_window, picture, run

import reconstructed  # isort: skip - _driving puts its folder on the path
from selenite.interface import panels
from selenite.interface.importing import tools as import_tools


def written():
    """Words of the import."""
    _, words = reconstructed.written(FOLDER / "pebble", replaces=False)
    return words["metashape"]


def steps():
    """See `_driving.run`."""
    file, _, cameras, _, photos = written()
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    yield 0.5
    in_window(bpy.ops.ed.undo_push, message="before")
    found = in_window(
        bpy.ops.selenite.import_reconstruction,
        "EXEC_DEFAULT",
        True,
        filepath=file,
        cameras=cameras,
        photos=photos,
    )
    assert found == {"FINISHED"}
    yield 0.5
    assert len(bpy.context.scene.selenite.captures) == 4
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert len(bpy.context.scene.selenite.captures) == 0
    assert not [item for item in bpy.data.objects if item.type == "CAMERA"]
    in_window(bpy.ops.ed.redo)
    yield 0.5
    assert len(bpy.context.scene.selenite.captures) == 4
    for item in bpy.data.objects:
        item.select_set(item.name == "pebble")
    bpy.context.view_layer.objects.active = bpy.data.objects["pebble"]
    assert in_window(bpy.ops.selenite.measure) == {"FINISHED"}
    in_window(bpy.ops.view3d.view_all)
    yield 1.0
    picture("imported")
    in_window(bpy.ops.view3d.view_camera)
    yield 1.0
    picture("through_camera")


import_tools.SELENITE_PT_reconstruction.bl_options = set()
run(steps, panels, {panels.SELENITE_PT_captures})
