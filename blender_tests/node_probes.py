# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials that shine by what a node gives, rendered by Cycles and by the program of the node."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import made_scenes as made
import numpy as np

from selenite.scene_read import build
from selenite.scene_read.scene import read_scene

SIZE = 24
_WIDTH = 2.0  # of what the camera sees

Node, Socket, Tree = bpy.types.Node, bpy.types.NodeSocket, bpy.types.NodeTree
#: Makes the nodes of a material and returns the socket that is shown.
Make = Callable[["Graph"], Socket]


class Graph:
    """The node tree of the material that is shown."""

    def __init__(self, tree: Tree) -> None:
        self.tree = tree

    def node(self, kind: str, inputs: dict[Any, Any] | None = None, **settings: Any) -> Node:
        """A node with its settings; inputs by name, identifier or number: a value or a socket."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in (inputs or {}).items():
            self.put(node, key, value)
        return node

    def put(self, node: Node, key: str | int, value: Any) -> None:
        """Gives an input a value, or links it."""
        if isinstance(key, int):
            socket = node.inputs[key]
        else:
            found = [item for item in node.inputs if key in {item.name, item.identifier}]
            socket = next((item for item in found if item.enabled), found[0])
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif socket.type == "RGBA" and len(value) == 3:
            socket.default_value = (*value, 1)
        else:
            socket.default_value = value

    def coordinates(self, output: str = "Object") -> Socket:
        """An output of Texture Coordinate."""
        return self.node("TexCoord").outputs[output]

    def place(self, scale: float = 1.0, offset: Any = (0, 0, 0)) -> Socket:
        """A vector that varies in all three numbers over a plane."""
        turned = self.node(
            "VectorRotate",
            {"Vector": self.coordinates(), "Axis": (1, 2, 3), "Angle": 0.7},
        ).outputs[0]
        names = {0: turned, 1: (scale,) * 3, 2: offset}
        return self.node("VectorMath", names, operation="MULTIPLY_ADD").outputs[0]


def scene(body: str = "plane") -> bpy.types.Material:
    """An empty file with a body under an orthographic camera; returns its material."""
    made.open_empty_file()
    if body == "plane":
        bpy.ops.mesh.primitive_plane_add(size=_WIDTH)
    else:
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.9, segments=24, ring_count=12)
        bpy.ops.object.shade_smooth()
    item = bpy.context.object
    item.name = "Body"
    material = bpy.data.materials.new("Shown")
    material.use_nodes = True
    item.data.materials.append(material)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location.z = 5
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = _WIDTH
    bpy.context.collection.objects.link(camera)
    settings = bpy.context.scene
    settings.camera = camera
    settings.render.engine = "CYCLES"
    settings.render.resolution_x = settings.render.resolution_y = SIZE
    settings.render.resolution_percentage = 100
    settings.cycles.samples = 1
    settings.cycles.use_adaptive_sampling = False
    settings.cycles.use_denoising = False
    settings.cycles.pixel_filter_type = "GAUSSIAN"
    settings.cycles.filter_width = 0.01
    settings.view_settings.view_transform = "Raw"
    return material


def shine(material: bpy.types.Material, make: Make) -> None:
    """Lets the material emit what a socket gives; vectors are moved to be positive by 2."""
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    tree.links.new(make(Graph(tree)), emission.inputs["Color"])


def of_cycles(tmp_path: Any) -> np.ndarray:
    """(SIZE, SIZE, 3) as Cycles renders it, row 0 at the top."""
    settings = bpy.context.scene.render
    settings.image_settings.file_format = "OPEN_EXR"
    settings.image_settings.color_depth = "32"
    settings.filepath = str(tmp_path / "probe.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(settings.filepath)
    pixels = np.array(image.pixels, np.float32).reshape(SIZE, SIZE, 4)[::-1, :, :3]
    bpy.data.images.remove(image)
    return pixels.astype(np.float64)


def places(material: bpy.types.Material, tmp_path: Any) -> np.ndarray:
    """Where Cycles' one sample of each pixel lies, in pixels from the top left."""
    shine(material, lambda graph: graph.node("NewGeometry").outputs["Position"])
    position = of_cycles(tmp_path)
    across = (position[..., 0] / _WIDTH + 0.5) * SIZE
    down = (0.5 - position[..., 1] / _WIDTH) * SIZE
    middle = np.stack(np.meshgrid(np.arange(SIZE) + 0.5, np.arange(SIZE) + 0.5), axis=-1)
    found = np.stack([across, down], axis=-1)
    return np.where(np.abs(found - middle) < 0.5, found, middle).astype(np.float32)


def ours(where: np.ndarray, by: str = "") -> np.ndarray:
    """(SIZE, SIZE, 3) that our program gives at these places, NaN beside the body."""
    values = read_scene(bpy.context.scene, surveys=False)
    assert not values.problems, values.problems
    native = build.build(values)
    (closure,) = native.shader_values("Shown", "Camera", SIZE, SIZE, by=by, places=where)
    color, strength = closure["inputs"]["color"], closure["inputs"]["strength"]
    return color if by else color * strength[..., :1]


class Probe:
    """A body under a camera, whose material is changed from probe to probe."""

    def __init__(self, body: str, scratch: Path) -> None:
        self.material = scene(body)
        self.scratch = scratch
        self.where = places(self.material, scratch)

    def difference(self, make: Make, share: float = 1.0) -> float:
        """Largest difference over the body's pixels, in units of the largest value; `share`: of
        the pixels, the nearest (another triangle may be hit on an edge)."""
        shine(self.material, make)
        cycles, program = of_cycles(self.scratch), ours(self.where)
        seen = np.isfinite(program[..., 0]) & (cycles.sum(axis=-1) != 0)
        assert seen.sum() > 100
        apart = np.abs(cycles - program).max(axis=-1)[seen]
        return float(np.quantile(apart, share) / np.abs(cycles[seen]).max())


def given(graph: Graph, node: Any, **values: Any) -> Any:
    """Gives those of the values that the node has inputs for."""
    for name, value in values.items():
        socket = node.inputs.get(name.replace("_", " "))
        if socket is not None and socket.enabled:
            graph.put(node, name.replace("_", " "), value)
    return node


def first(node: Any, name: str = "") -> Socket:
    """The first output in use, or the one of a name."""
    return next(item for item in node.outputs if item.enabled and name in {"", item.name})


def part(graph: Graph, number: int, scale: float = 1.7) -> Socket:
    return graph.node("SeparateXYZ", {0: graph.place(scale, (0.1, 0.2, 0.3))}).outputs[number]


def color(graph: Graph) -> Socket:
    return graph.place(0.6, (0.5, 0.45, 0.4))


def shifted(graph: Graph, socket: Socket) -> Socket:
    """Away from 0, where Cycles' emission could not be told from nothing."""
    return first(graph.node("VectorMath", {0: socket, 1: (2.0, 2.0, 2.0)}, operation="ADD"))
