# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev bench interface` runs in a Blender window."""

import math
import os
import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "blender_tests" / "gui"))
from _driving import in_window, made, press_escape, run, running, window  # noqa: E402

from selenite.interface import panels, state  # noqa: E402
from selenite.interface.running.run import FittingPhase, ReadingPhase  # noqa: E402

TICK = 0.1
FACES, HEIGHT, ITERATIONS, MODIFIER, REPEAT = (
    int(os.environ[f"SELENITE_BENCH_{name}"])
    for name in ("FACES", "HEIGHT", "ITERATIONS", "MODIFIER", "REPEAT")
)
PHOTOS = sorted(Path(os.environ["SELENITE_BENCH_PHOTOS"]).glob("View*.png"))


class Ticks:
    """Ten ticks a second on a fixed grid of times; a tick that another one has overtaken is lost.

    blocked: phase -> how late the latest tick of it was, in seconds.
    """

    def __init__(self):
        self.phase, self.due = "", 0.0
        self.came, self.lost, self.blocked, self.began = {}, {}, {}, {}

    def enter(self, phase):
        """What follows belongs to this phase."""
        self.phase = phase

    def __call__(self):
        now = time.monotonic()
        late = now - self.due if self.due else 0.0
        missed = int(late / TICK)
        phase = self.phase
        self.came[phase] = self.came.get(phase, 0) + 1
        self.lost[phase] = self.lost.get(phase, 0) + missed
        self.blocked[phase] = max(self.blocked.get(phase, 0.0), late)
        self.due = (self.due or now) + (missed + 1) * TICK
        return max(self.due - time.monotonic(), 0.001)


TICKS = Ticks()


def ball(segments):
    """A smooth UV sphere, segments * segments / 2 faces; Blender's own operator takes minutes."""
    rings = segments // 2
    around, down = np.meshgrid(
        np.arange(segments) * (2 * np.pi / segments), np.arange(1, rings) * (np.pi / rings)
    )
    places = np.stack(
        [np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)], axis=-1
    )
    places = np.vstack([places.reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]]).astype(np.float32)
    at = np.arange((rings - 1) * segments).reshape(rings - 1, segments)
    following = np.roll(at, -1, axis=1)
    quads = np.stack([at[:-1], at[1:], following[1:], following[:-1]], axis=-1).reshape(-1, 4)
    top = np.stack([np.full(segments, at.size), at[0], following[0]], axis=-1)
    bottom = np.stack([np.full(segments, at.size + 1), following[-1], at[-1]], axis=-1)
    mesh = bpy.data.meshes.new("Body")
    mesh.from_pydata(places.tolist(), [], [*quads.tolist(), *top.tolist(), *bottom.tolist()])
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    mesh.update()
    return made.add("Body", mesh)


def body():
    """A ball of so many faces, or a cube that a modifier makes one of."""
    material = made.material(base_color=(0.5, 0.4, 0.3), roughness=0.4)
    if MODIFIER:
        bpy.ops.mesh.primitive_cube_add(size=2.0)
        item = bpy.context.object
        smooth = item.modifiers.new("Smooth", "SUBSURF")
        smooth.levels, smooth.render_levels = 0, round(math.log(FACES / 6, 4))
    else:
        item = ball(2 * round(math.sqrt(FACES / 2)))
    item.data.materials.append(material)
    item.display_type = "BOUNDS"
    return item


def prepare():
    """The scene, a camera for each photo, and the panel as a user sets it up."""
    made.world()
    made.light(energy=300.0).location = (3.0, -3.0, 4.0)
    body()
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1280
    for index, photo in enumerate(PHOTOS):
        angle = 2 * math.pi * index / len(PHOTOS)
        camera = made.add(photo.stem, bpy.data.cameras.new(photo.stem))
        camera.location = (5 * math.sin(angle), -5 * math.cos(angle), 0.0)
        camera.rotation_euler = (math.pi / 2, 0.0, angle)
        scene.camera = camera
    bpy.context.view_layer.update()
    settings = scene.selenite
    assert in_window(bpy.ops.selenite.refresh_rows) == {"FINISHED"}
    for photo in PHOTOS:
        in_window(bpy.ops.selenite.add_capture)
        row = settings.captures[-1]
        row.photo = bpy.data.images.load(str(photo))
        row.camera = scene.objects[photo.stem]
    next(item for item in settings.rows if item.parameter == "base_color").enabled = True
    settings.height, settings.iterations, settings.loss = HEIGHT, ITERATIONS, "mae"
    settings.optimiser, settings.spp, settings.tolerance = "adam", 4, 0.0
    settings.picture_spp = 4
    settings.output = str(PHOTOS[0].parent / "results")
    return settings


def memory():
    """The most that this process has held, in GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def report():
    """The table, when all is done."""
    print(f"{'phase':<24}{'ticks':>7}{'lost':>9}{'blocked':>10}")
    for phase, came in TICKS.came.items():
        lost, blocked = TICKS.lost[phase], TICKS.blocked[phase]
        print(f"{phase:<24}{came:>7}{100 * lost / (came + lost):>7.1f} %{blocked:>8.2f} s")


def start():
    """Presses Start and goes along with the phases of the run."""
    TICKS.enter("reading")
    began = time.monotonic()
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    print(f"Start answered after {time.monotonic() - began:.2f} s", flush=True)
    while _reads():
        yield 0.02
    TICKS.enter("preparing")
    while state.RUN.is_active and not running():
        yield 0.02
    assert state.RUN.is_active, state.PROBLEMS
    print(f"read and prepared after {time.monotonic() - began:.1f} s", flush=True)
    TICKS.enter("fitting")


def ended(title):
    """Waits for the end of the run, from now."""
    began = time.monotonic()
    while state.RUN.is_active:
        yield 0.005
    print(f"{title}: {time.monotonic() - began:.3f} s", flush=True)


def pressed(phase, operator):
    """Presses a button of the panel, and waits until what it reads is read."""
    TICKS.enter(phase)
    began = time.monotonic()
    in_window(operator, "INVOKE_DEFAULT")
    answered = time.monotonic() - began
    while not state.is_idle():
        yield 0.02
    print(f"{phase}: {answered:.2f} s, {time.monotonic() - began:.2f} s to its end", flush=True)
    yield 1.0


def _is_cancelled():
    """Whether the panel says so of what is being read."""
    phase = state.RUN.phase
    return state.READING.is_cancelled or (_reads() and phase.job.is_stopped)


def _reads():
    """Whether Blender's thread evaluates the scene for a fit."""
    return isinstance(state.RUN.phase, ReadingPhase)


def steps():
    """See `_driving.run`."""
    # A display without a graphics card draws slowly, which says nothing about a fit.
    window()[3].overlay.show_overlays = False
    bpy.context.preferences.system.viewport_aa = "OFF"
    settings = prepare()
    yield 5.0
    print(f"{FACES} faces, {len(PHOTOS)} photos, {memory():.2f} GB before", flush=True)
    TICKS.enter("without a fit")
    bpy.app.timers.register(TICKS, first_interval=TICK)
    yield 10.0
    TICKS.enter("a redraw of the window")  # Blender's own; without a graphics card it takes long
    for _ in range(5):
        for area in window()[0].screen.areas:
            area.tag_redraw()
        yield 0.5
    for _ in range(REPEAT):
        yield from pressed("Refresh", bpy.ops.selenite.refresh_rows)
    for _ in range(REPEAT - 1):
        yield from start()
        in_window(bpy.ops.selenite.cancel)
        yield from ended("Cancel to stopped")
        TICKS.enter("after Cancel")
        yield 2.0
    yield from start()
    while isinstance(state.RUN.phase, FittingPhase):
        yield 0.02
    TICKS.enter("finishing")
    while state.RUN.is_active:
        yield 0.02
    yield 1.0
    assert len(bpy.context.scene.selenite.results) == 1, state.RUN.message
    TICKS.enter("saving")
    in_window(bpy.ops.selenite.save_result, "INVOKE_DEFAULT")
    while state.SAVE.job is not None:
        yield 0.02
    yield 1.0
    print(f"{memory():.2f} GB at most", flush=True)
    yield from pressed("Apply", bpy.ops.selenite.apply)
    yield from pressed("Restore", bpy.ops.selenite.restore)
    for name in ("Refresh", "Start"):
        TICKS.enter("Esc while reading")
        operator = bpy.ops.selenite.refresh_rows if name == "Refresh" else bpy.ops.selenite.start
        in_window(operator, "INVOKE_DEFAULT")
        yield 0.3
        reads = state.READING.job is not None or _reads()
        began = time.monotonic()
        press_escape()
        while reads and not _is_cancelled() and not state.is_idle():
            yield 0.005
        answered = time.monotonic() - began
        while not state.is_idle():
            yield 0.005
        over = time.monotonic() - began
        print(f"Esc in {name}, reading: {reads}: {answered:.3f} s, ended {over:.3f} s", flush=True)
        yield 1.0
    settings = bpy.context.scene.selenite
    settings.iterations = 1_000_000
    for title in ("Esc", "Cancel"):
        yield from start()
        yield 1.0
        TICKS.enter(title)
        if title == "Esc":
            press_escape()
        else:
            in_window(bpy.ops.selenite.cancel)
        yield from ended(f"{title} to stopped")
        yield 1.0
    bpy.app.timers.unregister(TICKS)
    report()


run(steps, panels, {panels.SELENITE_PT_head})
