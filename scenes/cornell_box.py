# SPDX-License-Identifier: GPL-3.0-or-later
"""Cornell box: red and green walls, a tall matte block, a short rough-glass block, a ceiling lamp.

Made from Blender primitives only (CC0). Run it inside bpy:

    python scenes/cornell_box.py --save start.blend           the scene with the start values
    python scenes/cornell_box.py --photos cornell_photos    the reference photos (minutes)
"""

import math
import sys
from pathlib import Path

import bpy
import mathutils

sys.path.insert(0, str(Path(__file__).resolve().parent))
from example_scene import Example, principled, set_comparison  # noqa: E402

MATERIAL = "Block"
RESOLUTION = (512, 512)
#: What the photos show.
TRUTH = {"base_color": (0.85, 0.55, 0.25), "roughness": 0.25, "transmission": 0.8, "ior": 1.4}
#: A grey, nearly opaque start.
START = {"base_color": (0.5, 0.5, 0.5), "roughness": 0.5, "transmission": 0.2, "ior": 1.6}
#: Where each camera stands; the box is 2 units wide and open at -y.
CAMERAS = {"Front": (0, -4.6, 1), "Low": (0.6, -1.75, 0.75)}
TARGETS = {"Front": (0, 0, 1), "Low": (0.2, 0, 0.5)}
WALLS = {
    # name: (centre, rotation, colour); the planes face the inside
    "Floor": ((0, 0, 0), (0, 0, 0), (0.73, 0.73, 0.73)),
    "Ceiling": ((0, 0, 2), (math.pi, 0, 0), (0.73, 0.73, 0.73)),
    "Back": ((0, 1, 1), (math.pi / 2, 0, 0), (0.73, 0.73, 0.73)),
    "Left": ((-1, 0, 1), (0, math.pi / 2, 0), (0.63, 0.065, 0.05)),
    "Right": ((1, 0, 1), (0, -math.pi / 2, 0), (0.14, 0.45, 0.091)),
}


def matte(name: str, color: tuple) -> bpy.types.Material:
    return principled(name, {"base_color": color, "roughness": 1.0, "specular_level": 0.0})


def add_walls() -> None:
    """Five squares of 2 units, facing the inside; the front is open."""
    white = matte("White", WALLS["Floor"][2])
    for name, (centre, rotation, color) in WALLS.items():
        bpy.ops.mesh.primitive_plane_add(size=2, location=centre, rotation=rotation)
        wall = bpy.context.object
        wall.name = name
        wall.data.materials.append(white if color == WALLS["Floor"][2] else matte(name, color))


def add_block(
    name: str, size: tuple, centre: tuple, turn: float, material: bpy.types.Material
) -> bpy.types.Object:
    """A block that stands on z = 0, turned about z by `turn` degrees."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    block = bpy.context.object
    block.name = name
    for vertex in block.data.vertices:
        vertex.co = [c * s for c, s in zip(vertex.co, size, strict=True)]
    # A hair above the floor: two surfaces in one plane would be seen in no order.
    block.location = (*centre, size[2] / 2 + 1e-3)
    block.rotation_euler = (0, 0, math.radians(turn))
    block.data.materials.append(material)
    return block


def add_lamp() -> bpy.types.Object:
    """A square of 0.6 units just below the ceiling, looking down."""
    data = bpy.data.lights.new("Ceiling Lamp", "AREA")
    data.energy = 25
    data.color = (1.0, 0.85, 0.62)
    data.size = 0.6
    lamp = bpy.data.objects.new("Ceiling Lamp", data)
    lamp.location = (0, 0, 1.99)
    bpy.context.collection.objects.link(lamp)
    return lamp


def add_camera(name: str, location: tuple, target: tuple) -> bpy.types.Object:
    data = bpy.data.cameras.new(name)
    data.lens = 56 if name == "Front" else 40
    camera = bpy.data.objects.new(name, data)
    camera.location = location
    towards = mathutils.Vector(target) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(camera)
    return camera


def build(values: dict) -> bpy.types.Scene:
    """Replaces the open file by the box, the short block's material holding `values`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    add_walls()
    tall = matte("Tall", (0.73, 0.73, 0.73))
    add_block("Tall Block", (0.6, 0.6, 1.2), (-0.35, 0.3), 17, tall)
    add_block("Short Block", (0.6, 0.6, 0.6), (0.35, -0.3), -17, principled(MATERIAL, values))
    add_lamp()
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    for name, location in CAMERAS.items():
        scene.camera = add_camera(name, location, TARGETS[name])
    scene.camera = bpy.data.objects["Front"]
    scene.render.resolution_x, scene.render.resolution_y = RESOLUTION
    scene.render.resolution_percentage = 100
    set_comparison(scene, samples=512)
    return scene


EXAMPLE = Example(__doc__ or "", build, MATERIAL, list(CAMERAS), TRUTH, START)

if __name__ == "__main__":
    EXAMPLE.main()
