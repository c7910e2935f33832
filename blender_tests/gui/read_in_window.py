# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene is read as it renders in a real window: nothing of the user's is touched."""

import sys

import bpy
from _driving import FOLDER, geometry, in_window, made, photographed, picture, press_escape, run

from selenite.interface import panels
from selenite.interface.running.run import ReadingPhase
from selenite.interface.state import READING, RUN, TRADE, is_idle
from selenite.scene_read.scene import read_scene


def prepare():
    """A ball that the viewport shows as a cube, a hidden cube, and a picture that was rendered."""
    made.world()
    made.camera()
    item = geometry.cube()
    modifier = item.modifiers.new("Smooth", "SUBSURF")
    modifier.levels, modifier.render_levels = 0, 3
    geometry.hide(geometry.cube("Hidden"), "eye")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    bpy.ops.render.render()


def rendered_size():
    """(width, height) of the picture that Blender keeps of the last render."""
    path = str(FOLDER / "kept.png")
    bpy.data.images["Render Result"].save_render(path)
    kept = bpy.data.images.load(path)
    size = tuple(kept.size)
    bpy.data.images.remove(kept)
    return size


def state():
    """What reading must leave alone."""
    scene = bpy.context.scene
    return (
        sorted(item.name for item in bpy.data.user_map()),
        scene.render.engine,
        scene.camera.name,
        scene.render.use_border,
        [item.name for item in bpy.context.view_layer.objects if item.select_get()],
        rendered_size(),
    )


def redraw():
    """All the time."""
    for area in bpy.context.window_manager.windows[0].screen.areas:
        area.tag_redraw()
    return 0.01


def steps():
    """See `_driving.run`."""
    prepare()
    yield 0.5
    before = state()
    assert before[-1] == (32, 24)
    in_window(bpy.ops.ed.undo_push, message="before")
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    yield 0.5
    assert state() == before
    values = read_scene(bpy.context.scene)
    assert values.triangle_count() == 2 * 6 * 4**3 + 12, values.triangle_count()
    assert len(bpy.context.scene.selenite.rows) > 0
    shown = bpy.context.evaluated_depsgraph_get()
    body = bpy.data.objects["Body"].evaluated_get(shown)
    assert len(body.data.polygons) == 6, "the viewport shows what it showed"

    in_window(bpy.ops.selenite.refresh_rows, "INVOKE_DEFAULT")
    assert READING.job is not None, "a button lets Blender's thread read"
    yield is_idle
    assert state() == before and len(bpy.context.scene.selenite.rows) > 0
    # Blender refuses every change for ever where its thread comes in while a panel draws.
    bpy.app.timers.register(redraw)
    for frame in range(20):
        in_window(bpy.ops.selenite.refresh_rows, "INVOKE_DEFAULT")
        yield is_idle
        bpy.context.scene.frame_start = frame
    bpy.app.timers.unregister(redraw)
    bpy.context.scene.selenite.rows.clear()
    in_window(bpy.ops.selenite.refresh_rows, "INVOKE_DEFAULT")
    press_escape()
    yield is_idle
    assert state() == before

    # Other buttons read in the same way, and Esc leaves all as it was.
    settings = photographed(0.4)
    settings.rows[0].enabled = True
    before = state()
    for button in ("preview_mask", "lamps_from_environment", "trade", "estimate"):
        in_window(getattr(bpy.ops.selenite, button), "INVOKE_DEFAULT")
        assert READING.job is not None, button
        press_escape()
        yield is_idle
        assert state() == before, button
    in_window(bpy.ops.selenite.preview_mask, "INVOKE_DEFAULT")
    yield is_idle
    assert "Selenite Mask" in bpy.data.images
    sys.modules["matplotlib"] = None  # that of .venv is of another numpy than this Blender's
    settings.trade_budget, settings.output = 3000.0, str(FOLDER / "fits")
    in_window(bpy.ops.selenite.trade, "INVOKE_DEFAULT")
    yield lambda: TRADE.job is not None and TRADE.step is not None and TRADE.step.fraction > 0
    press_escape()
    yield is_idle
    assert list((FOLDER / "fits").glob("*-trade/trade.json")), "what has been measured is kept"
    bpy.data.images.remove(bpy.data.images["Selenite Mask"])
    settings.captures.clear()
    bpy.context.scene.camera.data.background_images.clear()
    before = state()

    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    assert isinstance(RUN.phase, ReadingPhase), "Blender's thread reads the scene"
    yield lambda: not RUN.is_active  # there is no photo
    assert state() == before

    # A rendered viewport goes on, and is none of ours.
    space = next(
        area.spaces.active for area in bpy.context.window_manager.windows[0].screen.areas
        if area.type == "VIEW_3D"
    )  # fmt: skip
    space.shading.type = "RENDERED"
    yield 2.0
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    yield 2.0
    picture("rendered")
    assert space.shading.type == "RENDERED"
    space.shading.type = "SOLID"
    yield 0.5
    assert state() == before

    in_window(bpy.ops.ed.undo_push, message="rows")
    in_window(bpy.ops.ed.undo)
    yield 0.5
    assert len(bpy.data.scenes) == 1
    in_window(bpy.ops.ed.redo)
    yield 0.5
    assert len(bpy.data.scenes) == 1 and bpy.context.scene.render.engine == "CYCLES"
    assert read_scene(bpy.context.scene).triangle_count() == 2 * 6 * 4**3 + 12


run(steps, panels, {panels.SELENITE_PT_fit, panels.SELENITE_PT_parameters})
