# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the picture of docs/guide/node_graphs.md: a node graph rendered by Cycles and by Selenite.

Run with the Python that has bpy 4.5.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

import picture_row

ROOT = Path(__file__).resolve().parents[1]
for place in ("addon", "blender_tests"):
    sys.path.insert(0, str(ROOT / place))
SIZE, SAMPLES = 180, 160
TIMES = 10.0  # the difference is shown so many times as large


def glaze(graph: Any) -> Any:
    """Two colours by noise, under gloss where the surface is seen from aside; and a bump."""
    place = graph.coordinates("Generated")
    noise = graph.node("TexNoise", {"Vector": place, "Scale": 4.0, "Detail": 4.0})
    ramp = graph.node("ValToRGB", {0: noise.outputs[0]})
    first, second = ramp.color_ramp.elements
    first.position, second.position = 0.42, 0.58
    first.color, second.color = (0.05, 0.16, 0.4, 1), (0.75, 0.42, 0.16, 1)
    bump = graph.node("Bump", {"Strength": 0.4, "Distance": 0.1, "Height": noise.outputs[0]})
    normal = {"Normal": bump.outputs[0]}
    diffuse = graph.node("BsdfDiffuse", {"Color": ramp.outputs[0], **normal})
    glossy = graph.node("BsdfAnisotropic", {"Roughness": 0.25, **normal})
    share = graph.node("LayerWeight", {"Blend": 0.35}).outputs["Facing"]
    return graph.node("MixShader", {0: share, 1: diffuse.outputs[0], 2: glossy.outputs[0]})


def main() -> None:
    import graph_fits  # type: ignore[import-not-found]  # of blender_tests

    from selenite import native
    from selenite.scene_read import build
    from selenite.scene_read.scene import read_scene

    bpy.ops.wm.read_factory_settings(use_empty=True)
    folder, case = Path(tempfile.mkdtemp()), graph_fits.Case(glaze, {}, {})
    graph_fits.photographed(case, folder, size=SIZE, samples=SAMPLES)
    image = native.image()
    cycles = image.read(str(folder / "Front.exr"))[0]
    assert bpy.context.scene is not None  # noqa: S101 - of the case
    scene = build.build(read_scene(bpy.context.scene))
    ours = native.core().render(scene, "Front", SIZE, SIZE, SAMPLES, seed=1, threads=2).image

    def shown(pixels: np.ndarray) -> np.ndarray:
        return np.asarray(image.srgb_encode(np.clip(pixels, 0, 1).astype(np.float32)))

    pictures = {
        "Cycles": shown(cycles),
        "Selenite": shown(ours),
        f"difference, {TIMES:.0f} times": np.clip(TIMES * np.abs(cycles - ours), 0, 1),
    }
    picture_row.write(ROOT / "docs" / "pictures" / "node_graphs.png", pictures, (7.2, 2.6), 100)
    print(f"mean {(ours.mean() / cycles.mean() - 1) * 100:+.2f} %")  # noqa: T201


if __name__ == "__main__":
    main()
