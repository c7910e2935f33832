# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders Blender's start scene path by path and in lanes; prints means of the channels and CPU
seconds of both as one JSON object."""

import json
import os
import sys
import time

import bpy

from selenite import native
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

bpy.ops.wm.read_factory_settings()
scene = build(read_scene(bpy.context.scene))
found = {"means": [], "seconds": [], "lanes": native.core().lanes_obstacle(scene)}
for lanes in (1, 8) if not found["lanes"] else (1,):
    for parameters in ([], [("Material", "roughness"), ("Material", "metallic")]):
        since = time.process_time()
        film = native.core().render(
            scene, "Camera", 96, 64, 64, seed=3, threads=1, lanes=lanes, parameters=parameters
        )
        found["seconds"].append(time.process_time() - since)
        found["means"] += film.image.mean(axis=(0, 1)).tolist()
print(json.dumps(found))
sys.stdout.flush()
os._exit(0)  # Blender as a module can hang on the way out
