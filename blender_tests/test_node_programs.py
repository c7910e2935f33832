# SPDX-License-Identifier: GPL-3.0-or-later
"""The programs of nodes against Cycles: materials that shine by what a node gives.

Cycles renders one sample a pixel, whose place is known, so that both compute one number. They do
so in 32 and in 64 bits: noise looks up places far from the origin, which costs digits.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import node_probes as probes
import numpy as np
import pytest
from node_probes import Graph, Probe, Socket, color, first, given, part, shifted

EXACT = 1e-5
NOISE = 2e-4
#: Of a sphere's pixels: the others lie on edges, where here one triangle is hit and there another.
MOST = 0.95


def _words(text: str) -> list[str]:
    return text.split()


MATH = _words("""
    ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD POWER SQRT ABSOLUTE EXPONENT MINIMUM MAXIMUM LESS_THAN
    GREATER_THAN SIGN COMPARE SMOOTH_MIN SMOOTH_MAX ROUND FLOOR CEIL TRUNC FRACT MODULO
    FLOORED_MODULO WRAP SNAP PINGPONG SINE COSINE ARCSINE ARCCOSINE ARCTANGENT ARCTAN2 SINH COSH
    TANH RADIANS DEGREES LOGARITHM INVERSE_SQRT TANGENT
""")
VECTOR = _words("""
    ADD SUBTRACT MULTIPLY DIVIDE MULTIPLY_ADD CROSS_PRODUCT PROJECT REFLECT REFRACT FACEFORWARD
    DOT_PRODUCT DISTANCE LENGTH SCALE NORMALIZE ABSOLUTE POWER SIGN MINIMUM MAXIMUM FLOOR CEIL
    FRACTION MODULO WRAP SNAP SINE COSINE
""")
BLENDS = _words("""
    MIX DARKEN MULTIPLY BURN LIGHTEN SCREEN DODGE ADD OVERLAY SOFT_LIGHT LINEAR_LIGHT DIFFERENCE
    EXCLUSION SUBTRACT DIVIDE HUE SATURATION COLOR VALUE
""")
#: Where the slope is steep or the value huge, rounding of the inputs shows.
STEEP = {"DIVIDE", "POWER", "LOGARITHM", "INVERSE_SQRT", "TANGENT", "MODULO", "FLOORED_MODULO"}
STEEP |= {"WRAP", "SNAP", "PINGPONG"}


@pytest.fixture
def plane(tmp_path: Path) -> Probe:
    return Probe("plane", tmp_path)


@pytest.fixture
def sphere(tmp_path: Path) -> Probe:
    return Probe("sphere", tmp_path)


def test_math(plane: Probe) -> None:
    for name in MATH:

        def make(graph: Graph, name: str = name) -> Socket:
            inputs = {0: part(graph, 0), 1: part(graph, 1), 2: 0.4}
            return first(graph.node("Math", inputs, operation=name))

        assert plane.difference(make, 0.99) < EXACT, name
        if name not in STEEP:
            assert plane.difference(make) < EXACT, name


def test_vector_math(plane: Probe) -> None:
    for name in VECTOR:

        def make(graph: Graph, name: str = name) -> Socket:
            node = graph.node("VectorMath", {0: graph.place(1.7)}, operation=name)
            enabled = [item.name for item in node.inputs if item.enabled]
            if enabled.count("Vector") > 1:
                graph.put(node, 1, (0.5, 0.7, -0.3))
            if name in {"MULTIPLY_ADD", "WRAP", "FACEFORWARD"}:
                graph.put(node, 2, (0.1, -0.2, 0.3))
            return first(given(graph, node, Scale=0.6))

        assert plane.difference(make) < EXACT, name


@pytest.mark.parametrize("clamped", (False, True))
def test_mix_of_colors(plane: Probe, clamped: bool) -> None:
    for name in BLENDS:

        def make(graph: Graph, name: str = name) -> Socket:
            node = graph.node("Mix", data_type="RGBA", blend_type=name, clamp_result=clamped)
            graph.put(node, "Factor_Float", 0.7)
            graph.put(node, "A_Color", graph.place(0.8, (0.5, 0.5, 0.5)))
            graph.put(node, "B_Color", (0.6, 0.4, 0.2))
            return first(node)

        assert plane.difference(make) < EXACT, name


def test_color_ramp_and_curves(plane: Probe) -> None:
    for name in ("LINEAR", "EASE", "CONSTANT", "B_SPLINE", "CARDINAL"):

        def ramp(graph: Graph, name: str = name) -> Socket:
            node = graph.node("ValToRGB", {0: part(graph, 0, 1.1)})
            made = node.color_ramp
            made.interpolation = name
            made.elements[0].color, made.elements[0].position = (0.05, 0.1, 0.4, 1), 0.2
            made.elements[1].color = (0.9, 0.6, 0.1, 0.5)
            made.elements.new(0.6).color = (0.6, 0.1, 0.1, 0.3)
            return node.outputs["Color"]

        assert plane.difference(ramp) < EXACT, name
    for kind in ("RGBCurve", "VectorCurve", "FloatCurve"):
        for extend in ("EXTRAPOLATED", "HORIZONTAL"):

            def curve(graph: Graph, kind: str = kind, extend: str = extend) -> Socket:
                node = graph.node(kind)
                mapping = node.mapping
                mapping.extend = extend
                for number, item in enumerate(mapping.curves):
                    item.points.new(0.3 + 0.1 * number, 0.6 - 0.05 * number)
                mapping.update()
                place = graph.place(1.0, (0.5, 0.5, 0.5))
                return first(given(graph, node, Fac=0.8, Factor=0.8, Color=place, Vector=place,
                                   Value=part(graph, 0)))  # fmt: skip

            assert plane.difference(curve) < EXACT, (kind, extend)


def test_colors(plane: Probe) -> None:
    made: dict[str, probes.Make] = {
        "hue": lambda g: first(
            given(g, g.node("HueSaturation"), Hue=0.6, Saturation=1.4, Value=0.8, Fac=0.9,
                  Color=color(g))
        ),
        "contrast": lambda g: first(
            g.node("BrightContrast", {"Bright": 0.1, "Contrast": 0.3, "Color": color(g)})
        ),
        "gamma": lambda g: first(g.node("Gamma", {"Gamma": 1.8, "Color": color(g)})),
        "invert": lambda g: first(g.node("Invert", {"Fac": 0.8, "Color": color(g)})),
        "grey": lambda g: first(g.node("RGBToBW", {0: color(g)})),
        "cold": lambda g: first(g.node("Blackbody", {0: _kelvin(g, 600.0, 3000.0)})),
        "hot": lambda g: first(g.node("Blackbody", {0: _kelvin(g, 2000.0, 14000.0)})),
    }  # fmt: skip
    for name, make in made.items():
        assert plane.difference(make) < EXACT, name
    for mode in ("RGB", "HSV", "HSL"):

        def apart(graph: Graph, mode: str = mode) -> Socket:
            found = graph.node("SeparateColor", {0: color(graph)}, mode=mode).outputs
            return first(graph.node("CombineXYZ", dict(enumerate(found))))

        def together(graph: Graph, mode: str = mode) -> Socket:
            found = graph.node("SeparateXYZ", {0: color(graph)}).outputs
            return first(graph.node("CombineColor", dict(enumerate(found)), mode=mode))

        assert plane.difference(apart) < EXACT, mode
        assert plane.difference(together) < EXACT, mode


def _kelvin(graph: Graph, low: float, high: float) -> Socket:
    inputs = {"Value": part(graph, 0, 1.0), "From Min": -1.0, "To Min": low, "To Max": high}
    return first(graph.node("MapRange", inputs))


def test_ranges(plane: Probe) -> None:
    for name in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"):
        for clamp in (False, True):

            def number(graph: Graph, name: str = name, clamp: bool = clamp) -> Socket:
                node = graph.node("MapRange", interpolation_type=name, clamp=clamp)
                ends = {"From Min": -0.4, "From Max": 0.7, "To Min": 0.9, "To Max": 0.2}
                for key, value in {"Value": part(graph, 0), **ends}.items():
                    graph.put(node, key, value)
                return first(node)

            def vector(graph: Graph, name: str = name, clamp: bool = clamp) -> Socket:
                settings = {"interpolation_type": name, "clamp": clamp}
                node = graph.node("MapRange", data_type="FLOAT_VECTOR", **settings)
                graph.put(node, "Vector", graph.place(1.5))
                graph.put(node, "From_Min_FLOAT3", (-0.4, -0.3, 0.2))
                graph.put(node, "From_Max_FLOAT3", (0.7, 0.3, 0.2))
                graph.put(node, "To_Min_FLOAT3", (0.9, 0, 0.3))
                graph.put(node, "To_Max_FLOAT3", (0.2, 1, 0.6))
                return first(node)

            assert plane.difference(number) < EXACT, (name, clamp)
            assert plane.difference(vector) < EXACT, (name, clamp)
    for kind in ("MINMAX", "RANGE"):

        def clamped(graph: Graph, kind: str = kind) -> Socket:
            return first(graph.node("Clamp", {0: part(graph, 0), 1: 0.6, 2: 0.2}, clamp_type=kind))

        assert plane.difference(clamped) < EXACT, kind


def test_vectors(plane: Probe) -> None:
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):

        def mapping(graph: Graph, kind: str = kind) -> Socket:
            node = graph.node("Mapping", vector_type=kind)
            return first(given(graph, node, Rotation=(0.3, 0.5, -0.8), Scale=(0.7, 1.3, 2),
                               Vector=graph.place(1.2), Location=(0.1, 0.3, -0.2)))  # fmt: skip

        assert plane.difference(mapping) < EXACT, kind
    for kind in ("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"):
        for inverted in (False, True):

            def rotate(graph: Graph, kind: str = kind, inverted: bool = inverted) -> Socket:
                node = graph.node("VectorRotate", rotation_type=kind, invert=inverted)
                return first(given(graph, node, Vector=graph.place(), Center=(0.1, 0.2, 0.3),
                                   Axis=(1, -0.5, 0.3), Angle=0.8,
                                   Rotation=(0.3, 0.5, -0.8)))  # fmt: skip

            assert plane.difference(rotate) < EXACT, (kind, inverted)


def _image(**settings: Any) -> bpy.types.Image:
    y, x = np.mgrid[0:16, 0:16] / 16
    pixels = np.dstack([x, y, 0.5 + 0.5 * np.sin(9 * x), 0.3 + 0.7 * y]).astype(np.float32)
    image = bpy.data.images.new("Image", 16, 16, **settings)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def test_images(sphere: Probe) -> None:
    for projection in ("FLAT", "BOX", "SPHERE", "TUBE"):
        for output in ("Generated", "Object"):

            def projected(
                graph: Graph, projection: str = projection, output: str = output
            ) -> Socket:
                settings = {"projection": projection, "projection_blend": 0.3}
                node = graph.node("TexImage", image=_image(), **settings)
                graph.put(node, "Vector", graph.coordinates(output))
                return first(node)

            assert sphere.difference(projected) < EXACT, (projection, output)
        for interpolation in ("Linear", "Cubic"):  # by the UV map where nothing is linked

            def unlinked(
                graph: Graph, projection: str = projection, interpolation: str = interpolation
            ) -> Socket:
                settings = {"projection": projection, "projection_blend": 0.3}
                image = _image()
                return first(
                    graph.node("TexImage", image=image, interpolation=interpolation, **settings)
                )

            assert sphere.difference(unlinked, MOST) < EXACT, (projection, interpolation)
    image = _image(alpha=True)
    assert (
        sphere.difference(lambda g: g.node("TexImage", image=image).outputs["Alpha"], 0.99) < EXACT
    )


def test_inputs(sphere: Probe) -> None:
    made: dict[str, probes.Make] = {
        "fresnel": lambda g: first(g.node("Fresnel", {"IOR": 1.5})),
        "facing": lambda g: g.node("LayerWeight", {"Blend": 0.3}).outputs["Facing"],
        "facing more": lambda g: g.node("LayerWeight", {"Blend": 0.7}).outputs["Facing"],
        "weight": lambda g: g.node("LayerWeight", {"Blend": 0.3}).outputs["Fresnel"],
        "random": lambda g: g.node("ObjectInfo").outputs["Random"],
        "island": lambda g: g.node("NewGeometry").outputs["Random Per Island"],
        "length": lambda g: g.node("LightPath").outputs["Ray Length"],
        "camera": lambda g: g.node("LightPath").outputs["Is Camera Ray"],
        "distance": lambda g: g.node("CameraData").outputs["View Distance"],
        "depth": lambda g: g.node("CameraData").outputs["View Z Depth"],
        "view": lambda g: shifted(g, g.node("CameraData").outputs["View Vector"]),
    }
    for name, make in made.items():
        assert sphere.difference(make) < EXACT, name
    for name in ("Generated", "Normal", "UV", "Object", "Camera", "Reflection"):
        found = sphere.difference(lambda g, name=name: shifted(g, g.coordinates(name)), MOST)
        assert found < EXACT, name
    for name in ("Position", "Normal", "Incoming", "Parametric", "Backfacing"):
        found = sphere.difference(
            lambda g, name=name: shifted(g, g.node("NewGeometry").outputs[name]), MOST
        )
        assert found < EXACT, name
    for kind in ("POINT", "VECTOR", "NORMAL"):
        for between in (("WORLD", "OBJECT"), ("OBJECT", "CAMERA"), ("CAMERA", "WORLD")):

            def transform(graph: Graph, kind: str = kind, ends: Any = between) -> Socket:
                settings = {"convert_from": ends[0], "convert_to": ends[1], "vector_type": kind}
                inputs = {0: graph.coordinates()}
                return shifted(graph, first(graph.node("VectorTransform", inputs, **settings)))

            assert sphere.difference(transform) < EXACT, (kind, between)


def test_normals(sphere: Probe) -> None:
    for space in ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"):
        for strength in (0.5, 1.7):

            def normal_map(graph: Graph, space: str = space, strength: float = strength) -> Socket:
                inputs = {"Strength": strength, "Color": graph.place(0.2, (0.5, 0.5, 0.9))}
                return shifted(graph, first(graph.node("NormalMap", inputs, space=space)))

            assert sphere.difference(normal_map, MOST) < EXACT, (space, strength)
    for name in ("Object", "UV", "Normal"):
        for width in (0.1, 0.9):

            def bump(graph: Graph, name: str = name, width: float = width) -> Socket:
                place = {"Vector": graph.coordinates(name), "Scale": 4.0, "Detail": 1.0}
                height = first(graph.node("TexNoise", place))
                inputs = {"Strength": 0.7, "Distance": 0.3, "Filter Width": width, "Height": height}
                return shifted(graph, first(graph.node("Bump", inputs)))

            assert sphere.difference(bump, MOST) < NOISE, (name, width)


def test_derivatives_by_constants(plane: Probe) -> None:
    """Of a chain of nodes, against differences of the program's own values."""

    def make(graph: Graph) -> Socket:
        noise = given(graph, graph.node("TexNoise"), Vector=graph.place(), Scale=3.0, Detail=1.5)
        ramp = graph.node("ValToRGB", {0: noise.outputs["Fac"]})
        hue = graph.node("HueSaturation", {"Hue": 0.55, "Saturation": 0.8})
        graph.put(hue, "Color", ramp.outputs["Color"])
        mix = graph.node("Mix", {"Factor_Float": 0.4}, data_type="RGBA", blend_type="SOFT_LIGHT")
        graph.put(mix, "A_Color", (0.3, 0.5, 0.7))
        graph.put(mix, "B_Color", graph.node("Gamma", {0: first(hue), 1: 1.7}).outputs[0])
        return first(mix)

    probes.shine(plane.material, make)
    tree = plane.material.node_tree
    for node, name in (("Noise Texture", "Scale"), ("Mix", "Factor"), ("Gamma", "Gamma")):
        sockets = [item for item in tree.nodes[node].inputs if item.name == name and item.enabled]
        slope = probes.ours(plane.where, by=f"{node}.{name}")
        value, step = sockets[0].default_value, 1e-3
        sides = []
        for sign in (-1, 1):
            sockets[0].default_value = value + sign * step
            sides.append((sockets[0].default_value, probes.ours(plane.where)))
        sockets[0].default_value = value
        (low, before), (high, after) = sides
        difference = (after - before) / (high - low)
        apart = np.abs(slope - difference)
        assert np.abs(slope).max() > 1e-2
        assert np.quantile(apart, 0.98) < 2e-3 * np.abs(slope).max(), (node, name)
