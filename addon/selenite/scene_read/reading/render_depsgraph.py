# SPDX-License-Identifier: GPL-3.0-or-later
"""The dependency graph that a render engine gets: geometry as it renders, not as it is shown.

Blender makes it for an engine that renders, and for nobody else. So an engine of our own "renders"
two pixels of a copy of the scene, and reads while the graph lives. The copy keeps the user's
settings and the last picture as they are; its collections and objects are those of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeVar

import bpy

from ...messages import thing
from ...problems import Problem
from .entry import Entry
from .without_words import without_words

if TYPE_CHECKING:
    from ..hosts import BpyStruct

T = TypeVar("T")
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
_NO_WINDOW = {"render_display_type": "NONE"}
#: A video has at least 16 pixels a side, a picture any number. The depth and the mode of its
#: colours follow the format, so that they are put back after it.
_A_PICTURE = {"media_type": "IMAGE", "file_format": "PNG", "color_mode": "RGB", "color_depth": "8"}
#: How the lists of handlers begin that a render calls.
_OF_RENDERS = ("render_", "frame_change_", "depsgraph_update_", "composite_")


def view_layer_of(scene: bpy.types.Scene) -> bpy.types.ViewLayer:
    """The view layer that the picture of a render shows: the first one used for rendering."""
    shown = bpy.context.view_layer if bpy.context.scene == scene else scene.view_layers[0]
    if scene.render.use_single_layer:
        return shown
    return next((layer for layer in scene.view_layers if layer.use), shown)


class Stopped(Exception):  # noqa: N818 - it is no error
    """Who asked for it does not want it any more."""


@dataclass(frozen=True)
class GraphRead:
    """What is to be read of a scene's graph in render mode.

    cameras: are evaluated, whatever hides them. read: is called with the graph, which is gone
    afterwards with all in it, and with a function to call now and then, which raises Stopped.
    frame: where it is evaluated; None: where the scene is.
    """

    scene: bpy.types.Scene
    cameras: Sequence[bpy.types.Object]
    read: Callable[[bpy.types.Depsgraph, Callable[[], None]], None]
    frame: int | None = None

    def job(self) -> GraphRender:
        """For who goes through the reading."""
        return GraphRender(self)


class Gate(Protocol):
    """What a job may wait at, see Entry."""

    def open(self) -> None:
        """Nobody waits any more. From any thread."""

    def let_on(self) -> bool:
        """Whether the job has come to its graph."""


class Job(Protocol):
    """What a step of a reading is while it goes on: see GraphRender."""

    stopped: bool

    @property
    def entry(self) -> Gate:
        """Between the threads."""

    def start(self, *, waits: bool, note: Callable[[str], None] | None = None) -> None:
        """waits: returns at the end, and reports to `note` how far it is."""

    def is_running(self) -> bool:
        """After a start that has returned at once."""

    def text(self) -> str:
        """How far it is, "" where nobody knows."""

    def close(self) -> None:
        """After the end, or without a start."""

    def outcome(self) -> Problem | None:
        """After `close`: what stood in the way."""


class Asked(Protocol):
    """A step of a reading."""

    def job(self) -> Job:
        """What does it."""


#: A reading that goes from step to step, mostly graphs: it yields what it wants, and is sent what
#: stands in the way of that. So the same code reads at once and, in a window, while Blender stays
#: usable.
Reading = Generator[Asked, "Problem | None", T]


def at_once(reading: Reading[T], note: Callable[[str], None] | None = None) -> T:
    """The outcome of a reading. What it raises is raised. note: is told how far a long step is."""
    answer = None
    while True:
        try:
            asked = reading.send(answer)
        except StopIteration as end:
            found: T = end.value
            return found
        with closing(asked.job()) as render:
            render.start(waits=True, note=note)
        answer = render.outcome()


class GraphRender:
    """A render by an engine of our own, which reads the graph in place of rendering it. The user's
    handlers do not run; `close` puts everything back."""

    def __init__(self, asked: GraphRead) -> None:
        self.stopped = False  # set from any thread: the reading ends soon
        self._asked = asked
        self._called = False
        self._failure: BaseException | None = None
        self._reason = ""
        self._busy: Problem | None = None
        self._stack = ExitStack()
        self.entry = Entry()

    def start(self, *, waits: bool, note: Callable[[str], None] | None = None) -> None:
        """waits: returns at the end; it is too short for a `note`. Else at once: Blender then
        evaluates and reads in a thread of its own, and `is_running` says how long. A scene that is
        rendered itself is waited for, as nobody must touch it meanwhile."""
        scene = self._asked.scene
        running = next(
            (job for job in ("RENDER", "OBJECT_BAKE") if bpy.app.is_job_running(job)), ""
        )
        if running:
            cause = f"Blender is busy ({running.lower().replace('_', ' ')}) and cannot evaluate it"
            cure = "wait until that has ended, or stop it"
            self._busy = Problem(thing("Scene", scene.name), cause, cure)
            return
        layer = view_layer_of(scene)
        layer.update()  # what is pending reaches the user's handlers
        stack = self._stack
        stack.enter_context(without_handlers())
        reader = _engine_of(self)
        bpy.utils.register_class(reader)
        stack.callback(bpy.utils.unregister_class, reader)
        prepared = stack.enter_context(_prepared(scene, layer.name, self._asked.cameras))
        with ExitStack() as call:
            # The operator takes the frame from the context's scene.
            call.enter_context(bpy.context.temp_override(scene=scene, view_layer=layer))
            if waits or not _is_copied(scene):
                how = "EXEC_DEFAULT"
                call.enter_context(without_words())
            else:
                how = "INVOKE_DEFAULT"
                self.entry.arm()
                stack.callback(self.entry.disarm)
                call.enter_context(_set(bpy.context.preferences.view, _NO_WINDOW))
            try:
                bpy.ops.render.render(how, scene=prepared.name)
            except RuntimeError as error:
                self._reason = str(error).removeprefix("Error: ").strip()

    def close(self) -> None:
        """After the end, or without a start."""
        self._stack.close()

    def is_running(self) -> bool:
        """After a start that has returned at once."""
        return self._busy is None and bool(bpy.app.is_job_running("RENDER"))

    def text(self) -> str:
        """Blender does not say how far it is."""
        return ""

    def outcome(self) -> Problem | None:
        """After the end: what stood in the way. What `read` raised is raised."""
        if self._failure is not None:
            raise self._failure
        if self._busy is not None or self._called:
            return self._busy
        reason = self._reason or "no reason is given"
        cause = f"Blender does not evaluate it for a render ({reason})"
        cure = "render it once with Cycles to see what is in the way"
        return Problem(thing("Scene", self._asked.scene.name), cause, cure)

    def read(self, engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
        """Called by the engine."""
        self.entry.entered()
        self._called = True
        scene, frame = self._asked.scene, self._asked.frame

        def check() -> None:
            if self.stopped or engine.test_break():
                raise Stopped

        try:
            check()
            if frame is None:
                self._asked.read(depsgraph, check)
            else:
                with _at_frame(engine, scene, frame):
                    self._asked.read(depsgraph, check)
            check()  # Blender's own handler may have had the Esc
        except BaseException as error:  # Blender would print and forget it: Ctrl+C too
            self._failure = error


def _engine_of(reading: GraphRender) -> type[bpy.types.RenderEngine]:
    class Reader(bpy.types.RenderEngine):
        bl_idname = _ENGINE
        bl_label = _NAME

        def render(self, depsgraph: bpy.types.Depsgraph) -> None:
            reading.read(self, depsgraph)

    return Reader


@contextmanager
def _at_frame(engine: bpy.types.RenderEngine, scene: bpy.types.Scene, frame: int) -> Iterator[None]:
    """The graph is evaluated there. A scene that is rendered itself goes there too, and back; else
    its copy does, which is thrown away."""
    before = scene.frame_current, scene.frame_subframe
    engine.frame_set(frame, 0.0)
    try:
        yield
    finally:
        if not _is_copied(scene):
            engine.frame_set(*before)


def remarks(scene: bpy.types.Scene) -> Iterator[str]:
    """Why a render of the scene can show another one than is read."""
    title = thing("Scene", scene.name)
    for kind in ("render_init", "render_pre"):
        for function in getattr(bpy.app.handlers, kind):
            name = f"{function.__module__}.{getattr(function, '__qualname__', function)}"
            yield f"{title}: '{name}' ({kind}) runs before a render, and not when it is read"


@contextmanager
def without_handlers() -> Iterator[None]:
    """The user's handlers of renders do not run inside."""
    names = [name for name in dir(bpy.app.handlers) if name.startswith(_OF_RENDERS)]
    lists = {name: getattr(bpy.app.handlers, name) for name in names}
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
    copied = _is_copied(scene)
    with ExitStack() as stack:
        stack.callback(remove_new_pictures, pictures)
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
        if render.is_movie_format:
            # No video. Each of the properties limits those after it.
            stack.enter_context(_set(render.image_settings, _A_PICTURE, forwards=True))
        yield prepared


def _is_copied(scene: bpy.types.Scene) -> bool:
    """Copies of a rigid body world share its bodies, so such a scene is rendered itself."""
    return scene.rigidbody_world is None


def _side(render: bpy.types.RenderSettings, axis: str) -> float:
    return float(getattr(render, f"resolution_{axis}") * render.resolution_percentage / 100)


def remove_new_pictures(known: set[bpy.types.Image]) -> None:
    """Results of renders that are not `known`."""
    for item in [item for item in bpy.data.images if item.type == "RENDER_RESULT"]:
        if item not in known:
            item.user_clear()  # it counts itself
            bpy.data.images.remove(item)


@contextmanager
def _set(
    block: BpyStruct,  # any bpy struct
    values: Mapping[str, object],
    *,
    forwards: bool = False,
) -> Iterator[None]:
    """Properties have these values inside, set in this order and put back in the opposite one; or
    forwards, too. An engine or a format that this Blender does not have reads as "" and cannot be
    put back."""
    before = {name: getattr(block, name) for name in values if hasattr(block, name)}
    try:
        for name in before:
            setattr(block, name, values[name])
        yield
    finally:
        for name in before if forwards else reversed(before):
            if before[name] != "":
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
