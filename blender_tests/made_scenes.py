# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes by script, for Blender 3.4 and later."""

import importlib
import math

import bpy
import numpy as np

ALIASES = {
    "base_color": ("Base Color",),
    "roughness": ("Roughness",),
    "ior": ("IOR",),
    "transmission": ("Transmission Weight", "Transmission"),
    "alpha": ("Alpha",),
    "emission_color": ("Emission Color", "Emission"),
    "emission_strength": ("Emission Strength",),
}


def open_empty_file():
    """A file of factory settings without any object. Preferences and add-ons stay as they are:
    factory settings for these as well take eight times as long."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def add(name, data):
    """A new object in the scene's own collection."""
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    return item


def triangle(name="Body", material=None):
    """One triangle in the plane z = 0, counter-clockwise from above, with UVs."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([(0, 0, 0), (2, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0.0, 0.0, 1.0, 0.0, 0.0, 1.0])
    mesh.update()
    if material is not None:
        mesh.materials.append(material)
    return add(name, mesh)


def sphere(name="Body", material=None, segments=16):
    """A smooth UV sphere of radius 1 at the origin."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=segments // 2)
    item = bpy.context.object
    item.name = item.data.name = name
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    if material is not None:
        item.data.materials.append(material)
    return item


def material(name="Body", **values):
    """A Principled material with some values by parameter name."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    for parameter, value in values.items():
        found = socket(made, parameter)
        found.default_value = (*value, 1.0) if isinstance(value, tuple) else value
    return made


def principled(made):
    """The Principled node of a material."""
    return next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")


def socket(made, parameter):
    """The input of one of ALIASES, whatever this Blender calls it."""
    inputs = principled(made).inputs
    return next(inputs[name] for name in ALIASES[parameter] if name in inputs)


def link(material, output, parameter="base_color"):
    """Links an output to an input of the Principled node."""
    return material.node_tree.links.new(output, socket(material, parameter))


def camera(name="Camera", distance=5.0, **settings):
    """A camera on the z axis that looks down; the first becomes the scene's."""
    data = bpy.data.cameras.new(name)
    for key, value in settings.items():
        setattr(data, key, value)
    item = add(name, data)
    item.location = (0, 0, distance)
    scene = bpy.context.scene
    if scene.camera is None:
        scene.camera = item
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.render.resolution_percentage = 100
    return item


def light(name="Key", kind="POINT", **settings):
    """A lamp above the origin."""
    data = bpy.data.lights.new(name, kind)
    for key, value in settings.items():
        setattr(data, key, value)
    item = add(name, data)
    item.location = (0, 0, 3)
    item.rotation_euler = (0.3, 0.0, 0.0)
    return item


def world(color=(0.5, 0.5, 0.5), strength=1.0):
    """A world with a Background node."""
    made = bpy.data.worlds.new("Studio")
    made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    node.inputs["Color"].default_value = (*color, 1.0)
    node.inputs["Strength"].default_value = strength
    bpy.context.scene.world = made
    return made


def sample_coarsely(made):
    """Cycles draws light from a map of 256 columns in each render; of a generated image it would be
    of 8 million pixels."""
    made.cycles.sampling_method, made.cycles.sample_map_resolution = "MANUAL", 256


def shrink_panoramas(monkeypatch, parts):
    """Cycles evaluates worlds to panoramas with so many times fewer columns, and rows."""
    module = importlib.import_module("selenite.scene_read.shading.panorama.evaluate")
    for name in ("SIZE", "DETAILED"):
        width, height = getattr(module, name)
        monkeypatch.setattr(module, name, (width // parts, height // parts))


def environment(made, pixels, rotation=(0.0, 0.0, 0.0), kind="POINT"):
    """Gives the world an environment image, pixels (h, w, 3) with row 0 at the top."""
    sample_coarsely(made)
    tree = made.node_tree
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("sky", width, height, float_buffer=True)
    flipped = np.ones((height, width, 4), np.float32)
    flipped[..., :3] = pixels[::-1]
    image.pixels.foreach_set(flipped.ravel())
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    mapping = tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = kind
    mapping.inputs["Rotation"].default_value = rotation
    coordinates = tree.nodes.new("ShaderNodeTexCoord")
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(coordinates.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    return texture


def studio(**values):
    """A sphere, a camera, a grey world: enough for a fit."""
    made = material(**values)
    sphere(material=made)
    camera()
    world()
    return made


def board(**values):
    """A board of 2 x 2 units that fills the camera's picture, under a grey sky; its object."""
    filled = material(**{"base_color": (0.5, 0.5, 0.5), "roughness": 1.0} | values)
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    mesh.materials.append(filled)
    world(strength=1.0, color=(0.8, 0.8, 0.8))
    seen = camera(distance=2.0)
    seen.data.type, seen.data.ortho_scale = "ORTHO", 2.6
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 24
    return add("Board", mesh)


def hidden_ball(**values):
    """A smaller ball of the material 'Hidden', which no camera of `studio` sees."""
    made = material("Hidden", base_color=(0.2, 0.3, 0.6), **values)
    item = sphere("Behind", made)
    item.location, item.scale = (0.0, 0.0, -2.0), (0.5, 0.5, 0.5)
    return item


def smoke(density=2.0, colour=0.5, segments=16):
    """A sphere of grey smoke, a lamp from one side, a grey world; its material."""
    filled = material("Smoke")
    tree = filled.node_tree
    tree.nodes.remove(principled(filled))
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = density
    node.inputs["Color"].default_value = (colour, colour, colour, 1.0)
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    sphere(material=filled, segments=segments)
    camera()
    world(strength=0.5)
    light(energy=60)
    return filled


def save(path):
    """Saves the open file."""
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return str(path)


def photo(path, size=(32, 24), value=0.4):
    """A grey photo file; size is (width, height)."""
    from selenite import native

    pixels = np.full((size[1], size[0], 3), value, np.float32)
    image = native.image()
    write = image.write_exr if path.suffix == ".exr" else image.write_png
    write(str(path), pixels)
    return path


def read():
    """The open scene's values."""
    from selenite.scene_read.scene import read_scene

    return read_scene(bpy.context.scene)


def rotation_x(angle):
    """(3, 3) turn about x."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
