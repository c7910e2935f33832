# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D view stays visible while the scene is read."""

import threading

import bpy
from _driving import PICTURES, in_window, made, run, whole_screen

from selenite.interface import panels, state
from selenite.scene_read.reading import render_depsgraph

SEEN = threading.Event()  # the reading waits for it
LONGEST = 20.0  # seconds


def brightness(name):
    """Mean of the middle of the 3D view on the screen: 0 where it is black."""
    whole_screen(name)
    image = bpy.data.images.load(str(PICTURES / f"{name}.png"))
    width, height = image.size
    pixels = list(image.pixels)
    row = pixels[4 * width * (height // 2) :][: 4 * (width // 3)]
    bpy.data.images.remove(image)
    return sum(row) / len(row)


def steps():
    """See `_driving.run`."""
    made.world()
    camera = made.add("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, 0, 5)
    bpy.context.scene.camera = camera
    read = render_depsgraph.GraphRender.read

    def slow(self, *arguments):
        SEEN.wait(LONGEST)
        read(self, *arguments)

    render_depsgraph.GraphRender.read = slow
    for segments in (40, 300):
        item = made.sphere(segments=segments)
        item.data.materials.append(made.material())
        item.display_type = "BOUNDS"
        bpy.context.view_layer.update()
        yield 1.0
        before = brightness("before")
        SEEN.clear()
        in_window(bpy.ops.selenite.refresh_rows, "INVOKE_DEFAULT")
        yield 1.0
        assert state.READING.job is not None
        seen = brightness(f"reading {segments}")
        SEEN.set()
        assert abs(seen - before) < 0.1 * before, (seen, before)
        yield lambda: state.READING.job is None
        bpy.data.objects.remove(item)


run(steps, panels)
