# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the cube of Blender's start scene to a picture of it; prints values as shares of their
intervals, iterations and CPU seconds as one JSON object."""

import json
import os
import sys
import time

import bpy
import numpy as np

from selenite import native
from selenite.scene_read.build import build
from selenite.scene_read.scene import read_scene

bpy.ops.wm.read_factory_settings()
core = native.core()
inputs = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"].inputs
inputs["Base Color"].default_value = (0.6, 0.35, 0.1, 1)
inputs["Roughness"].default_value = 0.25
film = core.render(build(read_scene(bpy.context.scene)), "Camera", 48, 32, 1024, seed=5)
photo = core.Photo("Camera", np.ascontiguousarray(film.image, np.float32))
unknowns = [
    core.Unknown("Material", "base_color", minimum=0.001, maximum=0.999, start=(0.5, 0.5, 0.5)),
    core.Unknown("Material", "roughness", minimum=0.05, maximum=1, start=0.6),
]
settings = {"optimiser": "gauss-newton", "iterations": 20, "spp": 64, "threads": 1, "seed": 2}
since = time.process_time()
fit = core.Fit(build(read_scene(bpy.context.scene)), [photo], unknowns, settings)
fit.start()
fit.join()
found = fit.result()
if found.stopped in {core.StopReason.ERROR, core.StopReason.CANCELLED}:
    raise SystemExit(f"the fit failed: {found.stopped_because}")
shares = {}
for unknown, (lowest, highest) in zip(unknowns, ((0.001, 0.999), (0.05, 1)), strict=True):
    name = f"{unknown.owner}:{unknown.parameter}"
    for index, value in enumerate(np.ravel(found.values_best[name]).tolist()):
        shares[f"{name}[{index}]"] = value / (highest - lowest)
seconds = time.process_time() - since
count = len(found.history.iteration)
print(json.dumps({"shares": shares, "iterations": count, "seconds": seconds}))
sys.stdout.flush()
os._exit(0)  # Blender as a module can hang on the way out
