# SPDX-License-Identifier: GPL-3.0-or-later
"""Procedural textures against Cycles, as test_node_programs.py does it.

Noise looks up places far from the origin, which costs Cycles' 32 bits some digits.
"""

from __future__ import annotations

from pathlib import Path

import node_probes as probes
import pytest
from node_probes import Graph, Probe, Socket, first, given, part

EXACT = 1e-5
NOISE = 2e-4
GRADIENTS = (
    "LINEAR", "QUADRATIC", "EASING", "DIAGONAL", "SPHERICAL", "QUADRATIC_SPHERE", "RADIAL",
)  # fmt: skip


@pytest.fixture
def plane(tmp_path: Path) -> Probe:
    return Probe("plane", tmp_path)


@pytest.mark.parametrize("dimensions", ("1D", "2D", "3D", "4D"))
def test_noise(plane: Probe, dimensions: str) -> None:
    kinds = ("FBM", "MULTIFRACTAL", "HETERO_TERRAIN", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL")
    for kind in kinds:
        for output in ("Fac", "Color"):

            def noise(graph: Graph, kind: str = kind, output: str = output) -> Socket:
                node = graph.node("TexNoise", noise_dimensions=dimensions, noise_type=kind)
                node.normalize = output == "Color"
                return given(graph, node, Vector=graph.place(), W=part(graph, 1), Scale=3.7,
                             Detail=2.6, Roughness=0.6, Lacunarity=2.2, Offset=0.8, Gain=1.3,
                             Distortion=0.4).outputs[output]  # fmt: skip

            assert plane.difference(noise) < NOISE, (kind, output)
    for output in ("Value", "Color"):

        def white(graph: Graph, output: str = output) -> Socket:
            whole = first(graph.node("VectorMath", {0: graph.place(3.0)}, operation="FLOOR"))
            number = graph.node("SeparateXYZ", {0: whole}).outputs[1]
            node = graph.node("TexWhiteNoise", noise_dimensions=dimensions)
            return given(graph, node, Vector=whole, W=number).outputs[output]

        assert plane.difference(white) < EXACT, output


@pytest.mark.parametrize("dimensions", ("1D", "2D", "3D", "4D"))
def test_voronoi(plane: Probe, dimensions: str) -> None:
    def make(feature: str, detail: float, output: str, metric: str = "EUCLIDEAN") -> probes.Make:
        def voronoi(graph: Graph) -> Socket:
            node = graph.node("TexVoronoi", voronoi_dimensions=dimensions, feature=feature)
            node.distance, node.normalize = metric, detail > 0
            given(graph, node, Vector=graph.place(), W=part(graph, 1), Scale=3.7, Detail=detail,
                  Roughness=0.6, Lacunarity=2.2, Smoothness=0.7, Randomness=0.9,
                  Exponent=1.4)  # fmt: skip
            return first(node, output)

        return voronoi

    for detail in (0.0, 1.6):
        for feature in ("F1", "F2", "SMOOTH_F1"):
            for output in ("Distance", "Color", "W" if dimensions == "1D" else "Position"):
                found = plane.difference(make(feature, detail, output))
                assert found < NOISE, (feature, detail, output)
        assert plane.difference(make("DISTANCE_TO_EDGE", detail, "Distance")) < NOISE, detail
    assert plane.difference(make("N_SPHERE_RADIUS", 0, "Radius")) < NOISE
    for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI"):
        assert plane.difference(make("F2", 0, "Distance", metric)) < NOISE, metric


def test_other_textures(plane: Probe) -> None:
    for kind in ("BANDS", "RINGS"):
        for direction in ("X", "Y", "Z", "DIAGONAL" if kind == "BANDS" else "SPHERICAL"):
            for profile in ("SIN", "SAW", "TRI"):

                def wave(
                    graph: Graph, kind: str = kind, to: str = direction, profile: str = profile
                ) -> Socket:
                    node = graph.node("TexWave", wave_type=kind, wave_profile=profile)
                    setattr(node, f"{kind.lower()}_direction", to)
                    return first(given(graph, node, Vector=graph.place(), Scale=0.7, Detail=2.4,
                                       Distortion=1.5, Detail_Scale=1.3, Detail_Roughness=0.6,
                                       Phase_Offset=0.3))  # fmt: skip

                assert plane.difference(wave, 0.99) < NOISE, (kind, direction, profile)
    for depth in range(11):

        def magic(graph: Graph, depth: int = depth) -> Socket:
            node = graph.node("TexMagic", turbulence_depth=depth)
            return first(given(graph, node, Vector=graph.place(), Scale=0.8, Distortion=1.2))

        assert plane.difference(magic) < NOISE, depth
    for kind in GRADIENTS:

        def gradient(graph: Graph, kind: str = kind) -> Socket:
            return first(graph.node("TexGradient", {"Vector": graph.place()}, gradient_type=kind))

        assert plane.difference(gradient) < EXACT, kind
    colors = {"Color1": (0.9, 0.3, 0.1), "Color2": (0.1, 0.2, 0.5)}

    def checker(graph: Graph) -> Socket:
        return first(graph.node("TexChecker", {"Vector": graph.place(), "Scale": 3.3, **colors}))

    def brick(graph: Graph) -> Socket:
        settings = {"offset": 0.4, "offset_frequency": 3, "squash": 0.7, "squash_frequency": 2}
        inputs = {"Vector": graph.place(), "Scale": 4.3, "Mortar": (0.3, 0.3, 0.3), **colors}
        node = graph.node("TexBrick", inputs, **settings)
        return first(given(graph, node, Mortar_Size=0.05, Mortar_Smooth=0.3, Bias=-0.1))

    assert plane.difference(checker) < EXACT
    assert plane.difference(brick) < NOISE
