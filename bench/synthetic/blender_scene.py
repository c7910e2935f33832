# SPDX-License-Identifier: GPL-3.0-or-later
"""The stage as the open Blender file, for Cycles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import bpy
import mathutils
import numpy as np

from selenite import parameters
from selenite.scene_read.shading import volumes

from . import stage

#: Pixels of Cycles' importance map of the sky, several per pixel of the picture; its own choice
#: for a picture that is not a file takes 8 million.
_SKY_MAP = 256


def make(
    described: stage.Stage, values: Mapping[str, Any], image: np.ndarray | None = None
) -> bpy.types.Scene:
    """Replaces the open file. values: of the body, parameter name -> number or sequence. image: of
    its base colour, (h, w, 3) sRGB code values, row 0 at the top, rounded to bytes."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    body = _principled("Body", values)
    tiles = [
        _principled(f"Tile {i}", {"base_color": [level] * 3, "roughness": 1.0})
        for i, level in enumerate(stage.TILE_COLOURS)
    ]
    shape = _mesh("Body", described.body, [body])
    if image is not None:
        _show(image, body)
        layer = shape.uv_layers.new(name=stage.UV_MAP)
        corners = np.ascontiguousarray(stage.uvs(described.body), np.float32)
        layer.data.foreach_set("uv", corners.ravel())
    _add("Body", shape)
    _add("Floor", _mesh("Floor", described.floor, tiles))
    if described.lamp is not None:
        _add("Lamp", _lamp(described.lamp), described.lamp.matrix)
    for i, matrix in enumerate(described.cameras):
        _add(f"Camera {i + 1}", _camera(f"Camera {i + 1}"), matrix)
    bpy.context.scene.world = _world(described)
    bpy.context.scene.render.engine = "CYCLES"
    return bpy.context.scene


def _add(name: str, data: Any, matrix: np.ndarray | None = None) -> None:  # noqa: ANN401
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    if matrix is not None:
        item.matrix_world = mathutils.Matrix(matrix.tolist())


def _mesh(name: str, mesh: stage.Mesh, materials: list[bpy.types.Material]) -> bpy.types.Mesh:
    made = bpy.data.meshes.new(name)
    made.from_pydata(mesh.positions.tolist(), [], mesh.triangles.tolist())
    made.polygons.foreach_set("use_smooth", np.ones(len(mesh.triangles), bool))
    made.polygons.foreach_set("material_index", np.ascontiguousarray(mesh.slots, np.int32))
    # Blender's own normals weigh triangles by their angles; normals of this name replace them.
    normals = made.attributes.new("custom_normal", "FLOAT_VECTOR", "POINT")
    normals.data.foreach_set("vector", np.ascontiguousarray(mesh.normals, np.float32).ravel())
    for material in materials:
        made.materials.append(material)
    made.update()
    return made


def _principled(name: str, values: Mapping[str, Any]) -> bpy.types.Material:
    """Every parameter is set: Blender's factory values need not be ours."""
    table = {parameter.name: parameter for parameter in parameters.of("material")}
    unknown = set(values) - set(table)
    if unknown:
        raise ValueError(f"'{min(unknown)}' is no parameter of a material")
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    medium = None
    if "extinction" in values:
        output = tree.get_output_node("CYCLES")
        tree.links.new(tree.nodes.new("ShaderNodeVolumePrincipled").outputs[0], output.inputs[1])
        medium, reason = volumes.find_node(made)
        if medium is None:
            raise RuntimeError(reason)
    for parameter in table.values():
        given = np.ravel(values.get(parameter.name, parameter.initial))
        value = parameter.broadcast([float(number) for number in given])
        if parameter.name in volumes.PARAMETERS:
            if medium is not None:
                volumes.write(medium, parameter, value)
            continue
        socket = parameter.find(node)
        if socket is None:  # of an older or a newer Principled BSDF
            if parameter.name in values:
                raise RuntimeError(f"the Principled BSDF has no input for {parameter.name}")
            continue
        if parameter.width == 1:
            socket.default_value = value[0]
        else:
            socket.default_value = (*value, 1.0)[: len(socket.default_value)]
    return made


def _show(image: np.ndarray, material: bpy.types.Material) -> None:
    """The image as base colour of the material, by the mesh's UV map."""
    height, width = image.shape[:2]
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = image[::-1]  # Blender's row 0 is at the bottom
    tree = material.node_tree
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.new("Image", width, height)  # bytes, sRGB
    texture.image.pixels.foreach_set(pixels.ravel())
    texture.image.update()
    texture.extension, texture.interpolation = stage.EXTENSION, stage.INTERPOLATION
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    table = {parameter.name: parameter for parameter in parameters.of("material")}
    tree.links.new(texture.outputs["Color"], table["base_color"].find(node))


def _lamp(lamp: stage.Lamp) -> bpy.types.AreaLight:
    made = bpy.data.lights.new("Lamp", "AREA")
    made.shape, made.size, made.energy, made.spread = "SQUARE", lamp.side, lamp.power, np.pi
    return made


def _camera(name: str) -> bpy.types.Camera:
    made = bpy.data.cameras.new(name)
    made.lens, made.sensor_fit = stage.LENS_MM, "AUTO"
    made.sensor_width, made.sensor_height = stage.SENSOR_MM
    made.clip_start, made.clip_end = stage.CLIP
    return made


def _world(described: stage.Stage) -> bpy.types.World:
    made = bpy.data.worlds.new("World")
    made.use_nodes = True
    tree = made.node_tree
    background = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (*described.world, 1.0)
    if described.sky is not None:
        height, width = described.sky.shape[:2]
        pixels = np.ones((height, width, 4), np.float32)
        pixels[..., :3] = described.sky[::-1]  # Blender's row 0 is at the bottom
        texture = tree.nodes.new("ShaderNodeTexEnvironment")
        texture.image = bpy.data.images.new("Sky", width, height, float_buffer=True)
        texture.image.pixels.foreach_set(pixels.ravel())
        texture.image.update()
        tree.links.new(texture.outputs["Color"], background.inputs["Color"])
        made.cycles.sampling_method, made.cycles.sample_map_resolution = "MANUAL", _SKY_MAP
    return made
