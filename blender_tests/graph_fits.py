# SPDX-License-Identifier: GPL-3.0-or-later
"""Balls whose material is a node graph, photographed by Cycles: what a fit has to find again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import made_scenes as made
import numpy as np
from mathutils import Vector
from node_probes import Graph

Values = tuple[float, ...]
#: Position of each camera; all look at the ball's middle.
PLACES = {"Front": (0.0, -5.5, 1.2), "Left": (-4.2, -2.6, 2.4), "Back": (3.2, 4.0, 1.0)}


@dataclass(frozen=True)
class Case:
    """`make`: the graph, returns the node of the surface. `truth` and `start` by the constant's
    name."""

    make: Callable[[Graph], Any]
    truth: dict[str, Values]
    start: dict[str, Values]


def _stripes(graph: Graph) -> Any:
    """An image on the ball's own UV map."""
    rows, columns = np.mgrid[0:32, 0:32] / 32
    values = np.dstack([0.3 + 0.6 * columns, 0.4 + 0.5 * rows, 0.6 + 0.3 * np.sin(12 * columns)])
    pixels = np.ones((32, 32, 4), np.float32)
    pixels[..., :3] = np.clip(values, 0, 1)
    image = bpy.data.images.new("stripes", 32, 32)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return graph.node("TexImage", image=image).outputs[0]


def _noise(graph: Graph) -> Any:
    place = graph.coordinates("Generated")
    return graph.node("TexNoise", {"Vector": place, "Scale": 4.0}).outputs[0]


def _tint(graph: Graph) -> Any:
    mixed = graph.node(
        "Mix",
        {"Factor_Float": 1.0, "A_Color": _stripes(graph), "B_Color": (0.8, 0.5, 0.3)},
        data_type="RGBA",
        blend_type="MULTIPLY",
    )
    return graph.node("BsdfDiffuse", {"Color": mixed.outputs[2]})


def _ramp(graph: Graph) -> Any:
    node = graph.node("ValToRGB", {0: _noise(graph)})
    first, second = node.color_ramp.elements
    first.position, second.position = 0.35, 0.65
    first.color, second.color = (0.1, 0.2, 0.6, 1), (0.8, 0.5, 0.15, 1)
    return graph.node("BsdfDiffuse", {"Color": node.outputs[0]})


def _factor(graph: Graph) -> Any:
    diffuse = graph.node("BsdfDiffuse", {"Color": (0.7, 0.25, 0.1)})
    glossy = graph.node("BsdfAnisotropic", {"Color": (0.9, 0.9, 0.9), "Roughness": 0.3})
    return graph.node("MixShader", {0: 0.3, 1: diffuse.outputs[0], 2: glossy.outputs[0]})


def _ends(graph: Graph) -> Any:
    value = graph.node("MapRange", {0: _noise(graph), 1: 0.3, 2: 0.7, 3: 0.2, 4: 0.6})
    return graph.node("BsdfAnisotropic", {"Color": (0.8, 0.8, 0.8), "Roughness": value.outputs[0]})


def _metallic(graph: Graph) -> Any:
    inputs = {"Base Color": (0.85, 0.6, 0.35), "Roughness": 0.35}
    return graph.node("BsdfMetallic", inputs, fresnel_type="F82")


def _conductor(graph: Graph) -> Any:
    inputs = {"IOR": (0.2, 0.9, 1.2), "Extinction": (3.9, 2.4, 2.2), "Roughness": 0.35}
    return graph.node("BsdfMetallic", inputs, fresnel_type="PHYSICAL_CONDUCTOR")


def _stretched(graph: Graph) -> Any:
    inputs = {"Base Color": (0.8, 0.6, 0.4), "Metallic": 1.0, "Roughness": 0.45}
    highlights = {"Anisotropic": 0.7, "Anisotropic Rotation": 0.12}
    return graph.node("BsdfPrincipled", {**inputs, **highlights})


def _filmed(graph: Graph) -> Any:
    inputs = {"Base Color": (0.02, 0.02, 0.02), "Roughness": 0.3, "IOR": 1.8}
    film = {"Thin Film Thickness": 420.0, "Thin Film IOR": 1.45}
    return graph.node("BsdfPrincipled", {**inputs, **film})


def _glossy(graph: Graph) -> Any:
    return graph.node("BsdfAnisotropic", {"Color": (0.7, 0.5, 0.3), "Roughness": 0.3})


CASES = {
    "tint over an image": Case(_tint, {"Mix.B": (0.8, 0.5, 0.3)}, {"Mix.B": (0.5, 0.5, 0.5)}),
    "two stops of a ramp": Case(
        _ramp,
        {"Color Ramp.color[0]": (0.1, 0.2, 0.6), "Color Ramp.color[1]": (0.8, 0.5, 0.15)},
        {"Color Ramp.color[0]": (0.4, 0.4, 0.4), "Color Ramp.color[1]": (0.5, 0.5, 0.5)},
    ),
    "factor of a mix": Case(_factor, {"Mix Shader.Fac": (0.3,)}, {"Mix Shader.Fac": (0.0,)}),
    "both ends of a range": Case(
        _ends,
        {"Map Range.To Min": (0.2,), "Map Range.To Max": (0.6,)},
        {"Map Range.To Min": (0.4,), "Map Range.To Max": (0.4,)},
    ),
    "metallic": Case(
        _metallic,
        {"Metallic BSDF.Base Color": (0.85, 0.6, 0.35), "Metallic BSDF.Roughness": (0.35,)},
        {"Metallic BSDF.Base Color": (0.6, 0.6, 0.6), "Metallic BSDF.Roughness": (0.5,)},
    ),
    "conductor": Case(
        _conductor,
        {"Metallic BSDF.Extinction": (3.9, 2.4, 2.2), "Metallic BSDF.Roughness": (0.35,)},
        {"Metallic BSDF.Extinction": (3.0, 3.0, 3.0), "Metallic BSDF.Roughness": (0.5,)},
    ),
    "direction of highlights": Case(
        _stretched,
        {
            "Principled BSDF.Anisotropic": (0.7,),
            "Principled BSDF.Anisotropic Rotation": (0.12,),
            "Principled BSDF.Roughness": (0.45,),
        },
        {
            "Principled BSDF.Anisotropic": (0.4,),
            "Principled BSDF.Anisotropic Rotation": (0.06,),
            "Principled BSDF.Roughness": (0.3,),
        },
    ),
    "thin film": Case(
        _filmed,
        {"Principled BSDF.Thin Film Thickness": (420.0,), "Principled BSDF.Roughness": (0.3,)},
        {"Principled BSDF.Thin Film Thickness": (380.0,), "Principled BSDF.Roughness": (0.4,)},
    ),
    "glossy": Case(
        _glossy,
        {"Glossy BSDF.Color": (0.7, 0.5, 0.3), "Glossy BSDF.Roughness": (0.3,)},
        {"Glossy BSDF.Color": (0.5, 0.5, 0.5), "Glossy BSDF.Roughness": (0.5,)},
    ),
}


def photographed(case: Case, folder: Path, *, size: int, samples: int) -> tuple[str, list[str]]:
    """The scene with the start values, saved, and the words that name its photos."""
    material = bpy.data.materials.new("Body")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    graph = Graph(tree)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    graph.put(output, "Surface", case.make(graph).outputs[0])
    body = made.sphere(material=material, segments=32)
    # It moves the origins of shadow rays off coarse balls, which are 0.05 % brighter then.
    body.shadow_terminator_geometry_offset = 0.0
    made.world((0.6, 0.7, 0.8), 0.6)
    lamp = made.light("Key", "AREA", energy=250, size=1.5)
    lamp.location = (2.5, -3.0, 3.5)
    lamp.rotation_euler = (-lamp.location).to_track_quat("-Z", "Y").to_euler()
    words = []
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    # As a camera adds light up: a wider filter would blur the photo.
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BOX", 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    for name, place in PLACES.items():
        camera = made.camera(name, lens=70)
        camera.location = place
        camera.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()
        scene.camera = camera
        scene.render.resolution_x = scene.render.resolution_y = size
        scene.render.filepath = str(folder / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
        words += ["--photo", f"{name}={folder / name}.exr"]
    for name, value in case.start.items():
        words += ["--start", f"Body:{name}={','.join(map(str, value))}"]
    words += ["--fit", f"Body:{','.join(case.truth)}"]
    return made.save(folder / "scene.blend"), words
