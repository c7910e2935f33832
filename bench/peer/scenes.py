# SPDX-License-Identifier: GPL-3.0-or-later
"""One scene for two renderers: in the open Blender file, and as a description for Mitsuba."""

import math
import struct

import bpy
import made_scenes as made
import mathutils
import numpy as np

from selenite import native

CAMERA = {"origin": (1.9, -3.0, 1.5), "target": (0.0, 0.0, -0.05), "fov": 38.0}
LAMP = {"origin": (1.1, 0.8, 2.6), "target": (0.0, 0.0, 0.0), "size": 2.4, "power": 240.0}
WORLD = (0.5, 0.56, 0.66)
GROUND = (0.45, 0.4, 0.35)


def look_at(item, origin, target):
    item.location = origin
    towards = mathutils.Vector(target) - mathutils.Vector(origin)
    item.rotation_euler = towards.to_track_quat("-Z", "Y").to_euler()


def write_ply(path, item, uv=False):
    """The triangles of an object without transform: positions, and if wanted UVs of each corner."""
    data = item.data
    data.calc_loop_triangles()
    points = np.empty((len(data.vertices), 3), np.float32)
    data.vertices.foreach_get("co", points.ravel())
    corners = np.empty((len(data.loop_triangles), 3), np.int32)
    data.loop_triangles.foreach_get("vertices", corners.ravel())
    columns = "xyz"
    if uv:
        loops = np.empty((len(data.loop_triangles), 3), np.int32)
        data.loop_triangles.foreach_get("loops", loops.ravel())
        places = np.empty((len(data.loops), 2), np.float32)
        data.uv_layers.active.data.foreach_get("uv", places.ravel())
        places[:, 1] = 1 - places[:, 1]  # Mitsuba's v runs downwards
        points = np.hstack([points[corners.ravel()], places[loops.ravel()]])
        corners = np.arange(len(points), dtype=np.int32).reshape(-1, 3)
        columns = "xyzuv"
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    head += [f"property float {name}" for name in columns]
    head += [f"element face {len(corners)}", "property list uchar int vertex_indices"]
    rows = b"".join(struct.pack("<Biii", 3, *row) for row in corners.tolist())
    path.write_bytes(("\n".join([*head, "end_header"]) + "\n").encode() + points.tobytes() + rows)


def dented_ball(subdivisions=5):
    """A closed object with hollows and flat faces, named Body."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions)
    body = bpy.context.object
    body.name = body.data.name = "Body"
    for vertex in body.data.vertices:
        x, y, z = vertex.co
        vertex.co *= 1 + 0.06 * math.sin(5 * x + 1) * math.sin(4 * y) * math.cos(5 * z)
    body.data.update()
    return body


def glass_with_medium():
    """A material that `set_body` fills."""
    material = made.material("Body", base_color=(1.0, 1.0, 1.0), transmission=1.0)
    made.principled(material).distribution = "GGX"  # as Mitsuba: no energy compensation
    tree = material.node_tree
    medium = tree.nodes.new("ShaderNodeVolumePrincipled")
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(medium.outputs[0], output.inputs["Volume"])
    medium.inputs["Absorption Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    return material


def painted(image):
    """A diffuse material whose colour is an image with linear numbers."""
    material = made.material("Body")
    node = made.principled(material)
    node.inputs["Specular IOR Level"].default_value = 0.0
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(str(image))
    texture.image.colorspace_settings.name = "Non-Color"
    material.node_tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    return material


def set_body(body):
    """Puts the values of a description's body into the open file."""
    material = bpy.data.materials["Body"]
    for name in ("roughness", "ior"):
        made.socket(material, name).default_value = body[name]
    nodes = material.node_tree.nodes
    medium = next(n for n in nodes if n.bl_idname == "ShaderNodeVolumePrincipled")
    medium.inputs["Density"].default_value = body["sigma_t"]
    medium.inputs["Color"].default_value = (*body["albedo"], 1.0)
    medium.inputs["Anisotropy"].default_value = body["g"]


def make(kind, size, folder, material=glass_with_medium, subdivisions=5, uv=False):
    """Replaces the open file; returns the description, whose body lacks its values.

    "sky": a uniform world. "lamp": a disc above the body in a black world; a lamp of Cycles hides
    nothing, one of Mitsuba would hide some of the sky. `uv`: the body's file holds them.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    body = dented_ball(subdivisions)
    body.data.materials.append(material())
    bpy.ops.mesh.primitive_plane_add(size=9)
    ground = bpy.context.object
    ground.data.transform(mathutils.Matrix.Translation((0, 0, -1.08)))
    diffuse = made.material("Ground", base_color=GROUND)
    made.principled(diffuse).inputs["Specular IOR Level"].default_value = 0.0
    ground.data.materials.append(diffuse)
    camera = made.camera()
    look_at(camera, CAMERA["origin"], CAMERA["target"])
    camera.data.sensor_fit = "HORIZONTAL"
    camera.data.angle_x = math.radians(CAMERA["fov"])
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    world = WORLD if kind == "sky" else (0.0, 0.0, 0.0)
    made.world(world)
    lamp = None
    if kind == "lamp":
        item = made.light("Lamp", "AREA", energy=LAMP["power"], shape="DISK", size=LAMP["size"])
        look_at(item, LAMP["origin"], LAMP["target"])
        lamp = LAMP | {"radiance": 4 * LAMP["power"] / (math.pi * LAMP["size"]) ** 2}
    paths = {name: folder / f"{kind}_{name}.ply" for name in ("body", "ground")}
    write_ply(paths["body"], body, uv)
    write_ply(paths["ground"], ground)
    return {
        "size": size,
        "camera": CAMERA,
        "world": world,
        "lamp": lamp,
        "body": {"mesh": str(paths["body"])},
        "ground": {"mesh": str(paths["ground"]), "reflectance": GROUND},
    }


def make_textured(size, folder, texels):
    """A diffuse body of 82,000 triangles with a painted skin, under a lamp, is saved as skin.blend;
    returns the description, with "image": the skin, `texels` a side, linear."""
    across = (np.arange(texels) + 0.5) / texels
    u, v = np.meshgrid(across, across)
    waves = [np.sin(a * u + b * v + c) for a, b, c in ((31, 17, 0), (-23, 40, 1), (50, -9, 2))]
    image = folder / "skin.exr"
    pixels = 0.5 + 0.3 * np.stack(waves, axis=2)
    native.image().write_exr(str(image), np.ascontiguousarray(pixels, np.float32))
    description = make("lamp", size, folder, lambda: painted(image), subdivisions=7, uv=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "skin.blend"), compress=True)
    return description | {"image": str(image)}
