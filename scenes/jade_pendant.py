# SPDX-License-Identifier: GPL-3.0-or-later
"""Demo scene: a twisted jade-like pendant on a chequered ground, two cameras, one lamp, a grey sky.

Made from Blender primitives only (CC0). Run it inside bpy:

    python scenes/jade_pendant.py --save start.blend            the scene with the start values
    python scenes/jade_pendant.py --photos scenes/jade_pendant  the reference photos (minutes)
    blender -b --factory-startup --python scenes/jade_pendant.py -- --photos \
        scenes/jade_pendant/blender_3                           those of Blender 3, by Blender 3.4
"""

import math
import sys
from pathlib import Path

import bpy
import mathutils

sys.path.insert(0, str(Path(__file__).resolve().parent))
from example_scene import Example, principled, set_comparison  # noqa: E402

#: The photos that Cycles of this Blender would take: the Principled BSDF of Blender 3 has other
#: layers, so one material has another look there.
PHOTOS = Path(__file__).resolve().parent / "jade_pendant"
if bpy.app.version < (4, 0, 0):
    PHOTOS /= "blender_3"
MATERIAL = "Jade"
RESOLUTION = (768, 512)
#: What the photos show.
TRUTH = {"base_color": (0.33, 0.72, 0.47), "roughness": 0.3, "transmission": 0.65, "ior": 1.44}
#: The thesis's dark opaque start.
START = {"base_color": (0.01, 0.01, 0.01), "roughness": 0.5, "transmission": 0.02, "ior": 1.54}
CAMERAS = {"Front": (1.9, -3.5, 1.7), "Side": (-3.4, -1.9, 1.1)}


def add_pendant(material: bpy.types.Material) -> bpy.types.Object:
    """A bar with a waist, twisted by 160 degrees and smoothed; 1.5 units high, standing free."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    pendant = bpy.context.object
    pendant.name = "Pendant"
    for vertex in pendant.data.vertices:
        vertex.co = (vertex.co.x * 0.95, vertex.co.y * 0.5, vertex.co.z * 1.5)
    cut = pendant.modifiers.new("Cut", "SUBSURF")
    cut.subdivision_type = "SIMPLE"
    cut.levels = cut.render_levels = 3
    twist = pendant.modifiers.new("Twist", "SIMPLE_DEFORM")
    twist.deform_method = "TWIST"
    twist.deform_axis = "Z"
    twist.angle = math.radians(160)
    smooth = pendant.modifiers.new("Smooth", "SUBSURF")
    smooth.levels = smooth.render_levels = 2
    pendant.data.polygons.foreach_set("use_smooth", [True] * len(pendant.data.polygons))
    pendant.data.materials.append(material)
    pendant.location = (0, 0, 0.8)
    pendant.rotation_euler = (0, 0, math.radians(25))
    return pendant


def add_ground(light: bpy.types.Material, dark: bpy.types.Material) -> bpy.types.Object:
    """Chequered plane: the pattern behind the pendant is what shows how it refracts."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=16, y_subdivisions=16, size=8)
    ground = bpy.context.object
    ground.name = "Ground"
    ground.data.materials.append(light)
    ground.data.materials.append(dark)
    for face in ground.data.polygons:
        x, y = (math.floor(c * 2) for c in face.center[:2])
        face.material_index = (x + y) % 2
    return ground


def add_camera(name: str, location: tuple) -> bpy.types.Object:
    data = bpy.data.cameras.new(name)
    data.lens = 50
    camera = bpy.data.objects.new(name, data)
    camera.location = location
    towards = mathutils.Vector((0, 0, 0.72)) - camera.location
    camera.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(camera)
    return camera


def build(values: dict) -> bpy.types.Scene:
    """Replaces the open file by the demo scene, the pendant's material holding `values`."""
    # Not the factory settings: they would switch off the add-on whose demo this is.
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    add_pendant(principled(MATERIAL, values))
    add_ground(
        principled("Light tiles", {"base_color": (0.62, 0.6, 0.56), "roughness": 0.7}),
        principled("Dark tiles", {"base_color": (0.2, 0.1, 0.08), "roughness": 0.7}),
    )
    lamp = bpy.data.lights.new("Key", "AREA")
    lamp.energy = 95
    lamp.size = 2.4
    key = bpy.data.objects.new("Key", lamp)
    key.location = (1.3, 1.5, 3.0)
    towards = mathutils.Vector((0, 0, 0.7)) - key.location
    key.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(key)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.5, 0.56, 0.66, 1)
    for name, location in CAMERAS.items():
        scene.camera = add_camera(name, location)
    scene.camera = bpy.data.objects["Front"]
    scene.render.resolution_x, scene.render.resolution_y = RESOLUTION
    scene.render.resolution_percentage = 100
    set_comparison(scene, samples=512)
    return scene


EXAMPLE = Example(__doc__ or "", build, MATERIAL, list(CAMERAS), TRUTH, START)

if __name__ == "__main__":
    EXAMPLE.main()
