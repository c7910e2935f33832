# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of the cases, as .blend files. Nothing here but bpy: they do not depend on a revision.

python bench/golden/scenes.py FOLDER
"""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import bpy

LANDSCAPE, PORTRAIT, SQUARE = (32, 24), (24, 32), (24, 24)


def _empty(size: tuple[int, int]) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render = bpy.context.scene.render
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100


def _link(name: str, data: bpy.types.ID) -> bpy.types.Object:
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    return item


def _material(name: str, **values: float | tuple[float, ...]) -> bpy.types.Material:
    """A Principled BSDF; values by the name of the input, _ for a space."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    for key, value in values.items():
        known = (*value, 1.0) if isinstance(value, tuple) else value
        node.inputs[key.replace("_", " ")].default_value = known
    return made


def _smoke() -> bpy.types.Material:
    made = _material("Smoke")
    tree = made.node_tree
    tree.nodes.remove(next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled"))
    _fill(made)
    return made


def _fill(made: bpy.types.Material) -> None:
    """With a grey medium."""
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = 2.0
    node.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    output = tree.get_output_node("CYCLES")
    tree.links.new(node.outputs[0], output.inputs["Volume"])


def _sphere(material: bpy.types.Material) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    item = bpy.context.object
    item.name = item.data.name = material.name
    item.data.polygons.foreach_set("use_smooth", [True] * len(item.data.polygons))
    item.data.materials.append(material)


def _square(name: str, material: bpy.types.Material, half: float, height: float) -> None:
    mesh = bpy.data.meshes.new(name)
    corners = [(-half, -half, height), (half, -half, height)]
    corners += [(half, half, height), (-half, half, height)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    mesh.materials.append(material)
    _link(name, mesh)


def _floor() -> None:
    _square("Floor", _material("Floor", Base_Color=(0.6, 0.5, 0.4), Roughness=1.0), 3.0, -1.0)


def _camera(name: str, tilt: float = 0.0, turn: float = 0.0, **settings: float | str) -> None:
    """Five units from the origin, tilted away from the z axis, turned about it."""
    data = bpy.data.cameras.new(name)
    for key, value in settings.items():
        setattr(data, key, value)
    item = _link(name, data)
    aside = 5 * math.sin(tilt)
    item.location = (aside * math.sin(turn), -aside * math.cos(turn), 5 * math.cos(tilt))
    item.rotation_euler = (tilt, 0.0, turn)
    if bpy.context.scene.camera is None:
        bpy.context.scene.camera = item


def _lamp(energy: float = 60.0) -> None:
    data = bpy.data.lights.new("Key", "POINT")
    data.energy = energy
    _link("Key", data).location = (1.5, -1.0, 3.0)


def _world(strength: float = 1.0) -> None:
    made = bpy.data.worlds.new("Studio")
    made.use_nodes = True
    node = next(n for n in made.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    node.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    node.inputs["Strength"].default_value = strength
    bpy.context.scene.world = made


def _sky() -> None:
    """A sky image with a bright spot in place of the world's colour."""
    width, height = 16, 8
    pixels = []
    for row in range(height):
        for column in range(width):
            bright = 6.0 if (row, column) == (6, 5) else 0.2 + 0.05 * row
            pixels += [bright, bright * 0.9, bright * (0.7 + 0.02 * column), 1.0]
    image = bpy.data.images.new("Sky", width, height, float_buffer=True)
    image.pixels.foreach_set(pixels)
    image.pack()
    tree = bpy.context.scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    tree.links.new(texture.outputs["Color"], node.inputs["Color"])


def _show_image(material: bpy.types.Material) -> None:
    """4 x 4 texels as base colour: red below, blue above, brighter to the right."""
    pixels = []
    for row in range(4):
        for column in range(4):
            red, green, blue = (0.8, 0.3, 0.3) if row < 2 else (0.3, 0.4, 0.8)
            level = 0.7 + 0.12 * column
            pixels += [red * level, green * level, blue * level, 1.0]
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Image", 4, 4)
    texture.image.pixels.foreach_set(pixels)
    texture.image.update()
    texture.image.pack()
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])


def ball(size: tuple[int, int] = LANDSCAPE, shift: float = 0.0) -> None:
    """A ball on a floor, a lamp, a grey world, three cameras."""
    _empty(size)
    _sphere(_material("Body", Base_Color=(0.5, 0.5, 0.5), Roughness=0.5))
    _floor()
    _camera("Camera", 0.6, shift_x=shift)
    _camera("Left", 0.9, -1.2)
    _camera("Right", 0.9, 1.2)
    _lamp()
    _world(0.6)


def portrait() -> None:
    """The ball in a high picture, off its middle."""
    ball(PORTRAIT, shift=0.1)


def glass(image: bool = False) -> None:
    """A ball of clear or painted glass."""
    _empty(LANDSCAPE)
    colour = {"Base_Color": (0.6, 0.6, 0.6)}
    made = _material("Body", **colour, Roughness=0.3, IOR=1.45, Transmission_Weight=1.0)
    if image:
        _show_image(made)
    _sphere(made)
    _floor()
    _camera("Camera", 0.6)
    _lamp()
    _world(0.8)


def painted_glass() -> None:
    """What the photo of glass with an image shows."""
    glass(image=True)


def coated() -> None:
    """A ball under a coat: its two roughnesses are twins."""
    _empty(LANDSCAPE)
    colour = {"Base_Color": (0.5, 0.3, 0.2)}
    _sphere(_material("Body", **colour, Roughness=0.5, Coat_Weight=1.0, Coat_Roughness=0.3))
    _camera("Camera", 0.6)
    _lamp(120.0)
    _world(0.3)


def sky() -> None:
    """A ball under a sky image."""
    _empty(LANDSCAPE)
    _sphere(_material("Body", Base_Color=(0.5, 0.5, 0.5), Roughness=0.3, Metallic=0.5))
    _floor()
    _camera("Camera", 0.6)
    _world()
    _sky()


def smoke() -> None:
    """A sphere of grey smoke, a lamp from one side, a grey world."""
    _empty(LANDSCAPE)
    _sphere(_smoke())
    _camera("Camera")
    _lamp()
    _world(0.5)


def milk() -> None:
    """A ball of glass with a medium in it."""
    _empty(LANDSCAPE)
    made = _material("Milk", Roughness=0.2, IOR=1.3, Transmission_Weight=1.0)
    _fill(made)
    _sphere(made)
    _camera("Camera", 0.6)
    _lamp(120.0)
    _world(0.5)


def board(image: bool = False) -> None:
    """A board that fills the picture, grey or with an image."""
    _empty(SQUARE)
    made = _material("Body", Base_Color=(0.5, 0.5, 0.5), Roughness=0.8)
    if image:
        _show_image(made)
    _square("Board", made, 1.0, 0.0)
    _camera("Camera", type="ORTHO", ortho_scale=2.6)
    _lamp(40.0)
    _world(0.8)


def painted_board() -> None:
    """What the photo of the board shows."""
    board(image=True)


ALL = (ball, portrait, glass, painted_glass, coated, sky, smoke, milk, board, painted_board)

if __name__ == "__main__":
    for make in ALL:
        make()
        target = Path(sys.argv[1]) / f"{make.__name__}.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(target), check_existing=False)
    sys.stdout.flush()
    os._exit(0)  # bpy can hang in its own destructors
