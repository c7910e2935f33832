# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes that have every kind of datablock, for the table of Blender's properties."""

from __future__ import annotations

import bpy
import made_scenes as made
import numpy as np

from selenite.scene_read import properties


def scene_of_everything() -> None:
    """Objects of every type that is read, lamps of every type, images, a medium, a world."""
    made.open_empty_file()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    image = bpy.data.images.new("Picture", 4, 4)
    body = made.material(alpha=0.5, transmission=0.5)
    texture = body.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    made.link(body, texture.outputs["Color"])
    scatter = body.node_tree.nodes.new("ShaderNodeVolumeScatter")
    output = body.node_tree.get_output_node("CYCLES")
    body.node_tree.links.new(scatter.outputs[0], output.inputs["Volume"])
    item = made.triangle(material=body)
    item.modifiers.new("Levels", "SUBSURF")
    inner = bpy.data.collections.new("Props")
    scene.collection.children.link(inner)
    curve = bpy.data.curves.new("Wire", "CURVE")
    inner.objects.link(bpy.data.objects.new("Wire", curve))
    made.add("Words", bpy.data.curves.new("Words", "FONT"))
    made.add("Drop", bpy.data.metaballs.new("Drop"))
    cloud = bpy.data.volumes.new("Cloud")
    cloud.materials.append(body)
    made.add("Cloud", cloud)
    for kind in ("POINT", "SUN", "SPOT", "AREA"):
        made.light(kind.title(), kind).visible_camera = False
    made.camera()
    sky = made.world()
    environment = sky.node_tree.nodes.new("ShaderNodeTexEnvironment")
    environment.image = image
    background = next(n for n in sky.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    sky.node_tree.links.new(environment.outputs[0], background.inputs["Color"])


def scene_in_view() -> None:
    """The same, brought before the camera, so that each part has its share of a small picture."""
    scene_of_everything()
    scene = bpy.context.scene
    rng = np.random.default_rng(1)
    image = bpy.data.images["Picture"]
    image.pixels.foreach_set(rng.random(64).astype(np.float32))
    image.update()
    made.sphere("Ball", bpy.data.materials["Body"]).location = (1.2, 0.6, 0)
    mirror = made.material("Mirror", roughness=0.0)
    made.principled(mirror).inputs["Metallic"].default_value = 1.0
    wall = made.sphere("Wall", mirror)
    wall.location, wall.scale = (-1.3, 0.4, -0.2), (0.9, 0.9, 0.9)
    spline = bpy.data.curves["Wire"].splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, x in zip(spline.bezier_points, (-2, 2), strict=True):
        point.co, point.handle_left, point.handle_right = (x, -1.2, 0), (x, -2, 0), (x, -0.4, 0)
    bpy.data.curves["Wire"].bevel_depth = 0.1
    bpy.data.curves["Words"].extrude = 0.1
    bpy.data.metaballs["Drop"].elements.new().radius = 0.8
    scene.objects["Words"].location, scene.objects["Drop"].location = (-1, 1, 0.2), (0.2, -0.4, 0.5)
    bpy.data.objects.remove(scene.objects["Cloud"])
    places_of_lamps = {
        "Point": (2, 1, 2),
        "Spot": (-1, -1, 3),
        "Area": (0, 2, 2.5),
        "Sun": (0, 0, 4),
    }
    for name, place in places_of_lamps.items():
        lamp = scene.objects[name]
        lamp.location, lamp.visible_camera = place, False
        lamp.data.energy = 3.0 if name == "Sun" else 60.0
    bpy.data.lights["Point"].shadow_soft_size = bpy.data.lights["Spot"].shadow_soft_size = 0.3
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.render.resolution_percentage = 100
    cycles = scene.cycles
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    scene.render.threads_mode, scene.render.threads = "FIXED", 2
    bpy.context.view_layer.update()


def scope() -> properties.Scope:
    """The open scene as `read_scene` would see it, without a view of what is hidden."""
    scene = bpy.context.scene
    layer = bpy.context.view_layer
    objects = tuple(o for o in scene.objects if o.type not in {"CAMERA", "EMPTY"})
    materials = dict.fromkeys(
        slot.material for o in objects for slot in o.material_slots if slot.material is not None
    )
    return properties.Scope(
        scene=scene,
        view_layer=layer,
        objects=objects,
        instancers=properties.instancers_of(layer, objects),
        cameras=tuple(o for o in scene.objects if o.type == "CAMERA"),
        materials=tuple(materials),
        world=scene.world,
    )
