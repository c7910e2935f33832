# SPDX-License-Identifier: GPL-3.0-or-later
"""Photo, render and plots beside the 3D View while a fit runs and after it; through a camera and
back; saving, undo and loading meanwhile. Prints how many ticks of a 10 Hz timer were lost."""

import time

import bpy
import numpy as np
from _driving import ENDLESS, FOLDER, in_window, made, picture, press_escape, run, running, window

from selenite import native
from selenite.interface import panels, state
from selenite.interface.pictures import images, panel
from selenite.interface.pictures.view import VIEW
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

TRUTH = {"base_color": (0.75, 0.3, 0.08), "roughness": (0.3,)}
WIDTH, HEIGHT = 240, 180


def prepare():
    """Two spheres on a floor under a lamp; a photo of them at other values, part of it masked."""
    body = made.material("Body", base_color=(0.2, 0.25, 0.3), roughness=0.6)
    made.sphere(material=body, segments=32)
    bpy.ops.mesh.primitive_plane_add(size=8, location=(0, 0, -1))
    bpy.context.object.data.materials.append(made.material("Floor", base_color=(0.4, 0.4, 0.42)))
    camera = made.camera(distance=6.0)
    camera.location, camera.rotation_euler = (4.2, -4.2, 2.6), (1.17, 0.0, 0.785)
    made.light(kind="AREA", energy=150.0, size=2.0)
    made.world(color=(0.6, 0.7, 0.9), strength=0.4)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = WIDTH, HEIGHT
    bpy.context.view_layer.update()
    native_scene = build(read_scene(scene)).with_values(
        {("Body", name): value for name, value in TRUTH.items()}
    )
    film = native.core().render(native_scene, "Camera", WIDTH, HEIGHT, 64, seed=9)
    photo, mask = FOLDER / "Camera.png", FOLDER / "mask.png"
    native.image().write_png(str(photo), film.image)
    counts = np.ones((HEIGHT, WIDTH, 3), np.float32)
    counts[:, : WIDTH // 6] = 0
    native.image().write_png(str(mask), counts)
    settings = scene.selenite
    in_window(bpy.ops.selenite.refresh_rows)
    in_window(bpy.ops.selenite.add_capture)
    settings.captures[0].photo = bpy.data.images.load(str(photo))
    settings.captures[0].mask_path = str(mask)
    for row in settings.rows:
        row.enabled = row.owner == "Body" and row.parameter in TRUTH
    settings.search, settings.tolerance, settings.height = "off", 0.0, 96
    settings.threads = 1
    settings.optimiser, settings.loss, settings.iterations = "adam", "mae", ENDLESS


def pixels(name):
    """Of one of our images, as numbers."""
    image = bpy.data.images[name]
    found = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(found)
    return found.reshape(image.size[1], image.size[0], 4)


def shown(area):
    """What an editor shows, by name."""
    image = area.spaces.active.image
    return image.name if image is not None else ""


def editors():
    """All Image Editors of the window."""
    return [area for area in window()[0].screen.areas if area.type == "IMAGE_EDITOR"]


class Ticks:
    """Counts what a 10 Hz timer of the window manager gets, by a modal operator's clock."""

    def __init__(self):
        self.count, self.longest, self.before = 0, 0.0, time.perf_counter()
        self.first = self.before

    def __call__(self):
        now = time.perf_counter()
        self.count, self.longest = self.count + 1, max(self.longest, now - self.before)
        self.before = now
        return max(0.0, 0.1 * self.count - (now - self.first))

    def report(self, words):
        seconds = self.before - self.first
        due = round(seconds / 0.1)
        lost = max(0, due - self.count) / max(1, due)
        print(
            f"{words}: {self.count} of {due} ticks in {seconds:.1f} s, {lost:.1%} lost, longest "
            f"gap {self.longest:.2f} s; {VIEW.drawings} drawings, {VIEW.seconds:.2f} s of them"
        )


def steps():
    """See `_driving.run`."""
    prepare()
    chosen = bpy.context.window_manager.selenite_pictures
    camera = bpy.data.objects["Camera"]
    background = camera.data.background_images[0]
    before = (background.alpha, background.display_depth)
    in_window(bpy.ops.selenite.view_through, "EXEC_DEFAULT", True)
    yield 1.0
    assert window()[3].region_3d.view_perspective == "CAMERA"
    assert abs(background.alpha - 0.5) < 1e-6 and background.display_depth == "FRONT"
    picture("through")
    in_window(bpy.ops.selenite.view_through, "EXEC_DEFAULT", True)
    yield 0.5
    assert window()[3].region_3d.view_perspective == "PERSP"
    background = bpy.data.objects["Camera"].data.background_images[0]
    assert (background.alpha, background.display_depth) == before

    VIEW.is_unwanted = True  # as after Hide Pictures
    in_window(bpy.ops.selenite.start, "INVOKE_DEFAULT")
    yield running
    alone = Ticks()
    bpy.app.timers.register(alone)
    yield 8.0
    bpy.app.timers.unregister(alone)
    alone.report("A fit without pictures")

    in_window(bpy.ops.selenite.show_pictures)
    yield lambda: VIEW.drawings > 3
    yield 2.0
    assert [shown(area) for area in sorted(editors(), key=lambda area: -area.y)] == [
        images.COMPARISON,
        images.PLOTS,
    ]
    picture("running")
    VIEW.seconds, VIEW.drawings = 0.0, 0
    ticks = Ticks()
    bpy.app.timers.register(ticks)
    yield 10.0
    bpy.app.timers.unregister(ticks)
    ticks.report("A fit with pictures")
    chosen.mode = "DIFFERENCE"
    yield 2.0
    picture("difference")

    begin = time.perf_counter()
    press_escape()
    yield lambda: state.RUN.fitting is None
    print(f"Esc was answered in {time.perf_counter() - begin:.2f} s at most (asked each 0.1 s)")
    yield lambda: not VIEW.renderer.busy
    yield 1.0
    assert pixels(images.COMPARISON).std() > 0.05
    picture("fitted")
    chosen.mode, chosen.moment = "BEFORE_AFTER", "ITERATION"
    chosen.timeline = 30.0
    yield 1.5
    yield lambda: "of" in VIEW.moment_text() and not VIEW.renderer.busy
    yield 1.5
    picture("timeline")
    early = pixels(images.COMPARISON).copy()
    chosen.timeline = 0.0
    yield 1.0
    yield lambda: not VIEW.renderer.busy
    yield 1.0
    assert np.abs(pixels(images.COMPARISON) - early).mean() > 0.002
    chosen.content = "SHEET"
    yield lambda: images.SHEET in bpy.data.images and not VIEW.renderer.busy
    yield 1.5
    picture("sheet")

    in_window(bpy.ops.wm.save_as_mainfile, filepath=str(FOLDER / "saved.blend"), copy=True)
    yield 1.0
    assert all(shown(area) for area in editors()), "saving leaves the editors as they were"
    with bpy.data.libraries.load(str(FOLDER / "saved.blend")) as (there, _):
        assert not set(there.images) & set(images.NAMES.values()), "none is in the file"

    in_window(bpy.ops.selenite.apply, "EXEC_DEFAULT", True)
    yield 0.5
    in_window(bpy.ops.ed.undo)
    yield 1.0
    assert all(shown(area) for area in editors()), "undo leaves the editors as they were"

    in_window(bpy.ops.selenite.hide_pictures)
    yield 0.5
    assert not editors() and not VIEW.areas
    in_window(bpy.ops.selenite.show_pictures)
    yield 1.0
    assert editors()
    in_window(bpy.ops.wm.read_homefile, use_empty=True)
    yield 0.5
    assert not VIEW.areas and not VIEW.renderer.busy


panel.SELENITE_PT_pictures.bl_category = "Item"
run(steps, panels, (panels.SELENITE_PT_captures, panels.SELENITE_PT_fit))
