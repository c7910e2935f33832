# SPDX-License-Identifier: GPL-3.0-or-later
"""A ball in a dim room under a large lamp, photographed from four sides, opaque or translucent."""

import json
import math

import made_scenes as made

from selenite.cli import main
from selenite.write_back import body_models

VIEWS = 4
ALBEDO, EXTINCTION = (0.95, 0.9, 0.8), 2.0


def studio(tmp_path, translucent):
    """The scene to fit, in which the ball is opaque, and the file of the captures of its photos."""
    material = made.material(base_color=(0.6, 0.4, 0.3), roughness=0.4)
    ball = made.sphere(material=material)
    ball.data.uv_layers.remove(ball.data.uv_layers[0])
    made.world(color=(0.1, 0.1, 0.1))
    lamp = made.light("Lamp", "AREA", energy=300.0, size=3.0)
    lamp.location = (0.0, 0.0, 4.0)
    for index in range(VIEWS):
        turn = 2 * math.pi * index / VIEWS
        item = made.camera(f"Camera {index}")
        item.location = (5 * math.sin(turn), -5 * math.cos(turn), 0.0)
        item.rotation_euler = (math.pi / 2, 0.0, turn)
    start = made.save(tmp_path / "start.blend")
    if translucent:
        body_models.make_medium(material)
    true = made.save(tmp_path / "true.blend")
    words = ["--spp", "2048" if translucent else "256", "--height", "20"]
    if translucent:
        words += ["--set", f"Body:albedo={','.join(map(str, ALBEDO))}"]
        words += ["--set", f"Body:extinction={EXTINCTION},{EXTINCTION},{EXTINCTION}"]
    rows = []
    for index in range(VIEWS):
        photo = tmp_path / f"{index}.exr"
        camera = ["--camera", f"Camera {index}", "--seed", str(index)]
        assert main(["render", true, "--out", str(photo), *camera, *words]) == 0
        rows.append({"camera": f"Camera {index}", "photo": photo.name, "response": "linear"})
    captures = tmp_path / "captures.json"
    captures.write_text(json.dumps({"schema": 1, "captures": rows}))
    return start, str(captures)
