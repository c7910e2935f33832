# SPDX-License-Identifier: GPL-3.0-or-later
"""The dependency graph that a render engine gets: geometry as it renders, not as it is shown.

Blender makes it for an engine that renders, and for nobody else. So an engine of our own "renders"
two pixels of a copy of the scene, and reads while the graph lives. The copy keeps the user's
settings and the last picture as they are; its collections and objects are those of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import Any

import bpy

from ..problems import Problem
from .without_words import without_words

_ENGINE = "SELENITE_SCENE_READ"
_NAME = "Selenite reads this scene"
#: What costs time or memory in a render and says nothing about the scene.
_PLAIN = {
    "use_compositing": False,
    "use_sequencer": False,
    "use_freestyle": False,
    "use_multiview": False,
    "use_persistent_data": False,
    "use_single_layer": False,
    "use_border": True,
    "use_crop_to_border": True,
    "border_min_x": 0.0,
    "border_min_y": 0.0,
    "engine": _ENGINE,
}


def view_layer_of(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer that the picture of a render shows: the first one used for rendering."""
    shown = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    if scene.render.use_single_layer:
        return shown
    return next((layer for layer in scene.view_layers if layer.use), shown)


def read_as_rendered(
    scene: bpy.types.Scene,
    cameras: Sequence[bpy.types.Object],
    read: Callable[[bpy.types.Depsgraph], None],
    frame: int | None = None,
) -> Problem | None:
    """Calls `read` with the scene's graph in render mode, which also evaluates `cameras`, whatever
    hides them. The graph and all in it are gone afterwards. Returns what stands in the way.
    frame: where it is evaluated; None: where the scene is.

    The user's handlers do not run. What `read` raises is raised.
    """
    title = f"Scene '{scene.name}'"
    running = next((job for job in ("RENDER", "OBJECT_BAKE") if bpy.app.is_job_running(job)), None)
    if running:
        cause = f"Blender is busy ({running.lower().replace('_', ' ')}) and cannot evaluate it"
        return Problem(title, cause, "wait until that has ended, or stop it")
    layer = view_layer_of(scene)
    called: list[bool] = []
    failures: list[Exception] = []

    class Reader(bpy.types.RenderEngine):
        bl_idname = _ENGINE
        bl_label = _NAME

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            called.append(True)
            try:
                # Of this graph alone: the scene itself stays where it is.
                if frame is not None:
                    self.frame_set(frame, 0.0)
                read(depsgraph)
                if frame is not None:
                    self.frame_set(scene.frame_current, scene.frame_subframe)
            except Exception as error:  # Blender would print and forget it
                failures.append(error)

    layer.update()  # what is pending reaches the user's handlers
    reason = ""
    with ExitStack() as stack:
        stack.enter_context(_without_handlers())
        bpy.utils.register_class(Reader)
        stack.callback(bpy.utils.unregister_class, Reader)
        prepared = stack.enter_context(_prepared(scene, layer.name, cameras))
        # The operator takes the frame from the context's scene.
        stack.enter_context(bpy.context.temp_override(scene=scene, view_layer=layer))
        stack.enter_context(without_words())
        try:
            bpy.ops.render.render(scene=prepared.name)
        except RuntimeError as error:
            reason = str(error).removeprefix("Error: ").strip()
    if failures:
        raise failures[0]
    if not called:
        cause = f"Blender does not evaluate it for a render ({reason or 'no reason is given'})"
        return Problem(title, cause, "render it once with Cycles to see what is in the way")
    return None


def remarks(scene: bpy.types.Scene) -> Iterator[str]:
    """Why a render of the scene can show another one than is read."""
    title = f"Scene '{scene.name}'"
    for kind in ("render_init", "render_pre"):
        for function in getattr(bpy.app.handlers, kind):
            name = f"{function.__module__}.{getattr(function, '__qualname__', function)}"
            yield f"{title}: '{name}' ({kind}) runs before a render, and not when it is read"


@contextmanager
def _without_handlers() -> Iterator[None]:
    lists = {name: getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)}
    lists = {name: item for name, item in lists.items() if isinstance(item, list)}
    kept = {name: list(item) for name, item in lists.items()}
    for item in lists.values():
        item.clear()
    try:
        yield
    finally:
        for name, item in lists.items():
            item[:] = kept[name]


@contextmanager
def _prepared(
    scene: bpy.types.Scene, layer: str, cameras: Sequence[bpy.types.Object]
) -> Iterator[bpy.types.Scene]:
    """A scene that renders a few pixels with our engine, for a moment."""
    pictures = {item for item in bpy.data.images if item.type == "RENDER_RESULT"}
    # Copies of a rigid body world share its bodies, so such a scene is used itself.
    copied = scene.rigidbody_world is None
    with ExitStack() as stack:
        stack.callback(_remove_new_pictures, pictures)
        prepared = scene
        if copied:
            prepared = scene.copy()
            stack.callback(bpy.data.scenes.remove, prepared)
            prepared.name = _NAME
        stack.enter_context(_with_cameras(prepared, cameras))
        render = prepared.render
        if min(_side(render, "x"), _side(render, "y")) < 1:  # of no pixels Blender renders nothing
            stack.enter_context(_set(render, {"resolution_percentage": 100}))
        wanted = _PLAIN | {
            "border_max_x": min(2 / _side(render, "x"), 1),
            "border_max_y": min(2 / _side(render, "y"), 1),
        }
        for item in prepared.view_layers:
            stack.enter_context(_set(item, {"use": item.name == layer}))
        stack.enter_context(_set(render, wanted))
        yield prepared


def _side(render: bpy.types.RenderSettings, axis: str) -> float:
    return float(getattr(render, f"resolution_{axis}") * render.resolution_percentage / 100)


def _remove_new_pictures(known: set[bpy.types.Image]) -> None:
    for item in [item for item in bpy.data.images if item.type == "RENDER_RESULT"]:
        if item not in known:
            item.user_clear()  # it counts itself
            bpy.data.images.remove(item)


@contextmanager
def _set(block: Any, values: dict[str, Any]) -> Iterator[None]:  # noqa: ANN401 - any bpy struct
    """Properties have these values inside; the engine is set last and put back first."""
    before = {name: getattr(block, name) for name in values if hasattr(block, name)}
    try:
        for name in before:
            setattr(block, name, values[name])
        yield
    finally:
        for name in reversed(before):
            setattr(block, name, before[name])


@contextmanager
def _with_cameras(scene: bpy.types.Scene, cameras: Sequence[bpy.types.Object]) -> Iterator[None]:
    """Has every camera evaluated, whatever hides it: for that it has to be visible in a render. A
    scene without a camera gets one, else nothing renders."""
    before = scene.camera
    known = set(scene.collection.objects)
    added = [item for item in cameras if item not in known]
    hidden = [item for item in cameras if item.hide_render]
    data = None
    try:
        for item in added:
            scene.collection.objects.link(item)
        for item in hidden:
            item.hide_render = False
        if before is None or before.type != "CAMERA":
            if not cameras:
                data = bpy.data.cameras.new(_NAME)
            scene.camera = cameras[0] if cameras else bpy.data.objects.new(_NAME, data)
        yield
    finally:
        scene.camera = before
        for item in hidden:
            item.hide_render = True
        for item in added:
            scene.collection.objects.unlink(item)
        if data is not None:
            bpy.data.cameras.remove(data)  # and the object that has it
