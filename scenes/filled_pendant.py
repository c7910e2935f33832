# SPDX-License-Identifier: GPL-3.0-or-later
"""The pendant of `jade_pendant.py`, 3 cm high, as rough glass with a medium in it.

    python scenes/filled_pendant.py --save filled.blend
    python scenes/filled_pendant.py --picture docs/pictures/volumes.png     the guide's picture

The picture shows it three times, each with a tenth of the mean free path of the one before.
"""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import jade_pendant  # noqa: E402

METRES_PER_UNIT = 0.02
GLASS = {"base_color": (1.0, 1.0, 1.0), "roughness": 0.1, "transmission": 1.0, "ior": 1.44}
DENSITIES = (0.5, 5.0, 50.0)
#: Colour and absorption colour of the Principled Volume: most of what is met is scattered.
COLOR, ABSORPTION, ANISOTROPY = (0.45, 0.85, 0.6), (0.93, 0.88, 0.89), 0.5
SIZE = (160, 210)


def build(density: float) -> bpy.types.Scene:
    """Replaces the open file; the pendant's material has a Principled Volume of that density."""
    scene = jade_pendant.build(GLASS)
    scene.unit_settings.system, scene.unit_settings.scale_length = "METRIC", METRES_PER_UNIT
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.camera.data.lens = 66
    tree = bpy.data.materials[jade_pendant.MATERIAL].node_tree
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Color"].default_value = (*COLOR, 1)
    node.inputs["Absorption Color"].default_value = (*ABSORPTION, 1)
    node.inputs["Density"].default_value = density
    node.inputs["Anisotropy"].default_value = ANISOTROPY
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    tree.links.new(node.outputs["Volume"], output.inputs["Volume"])
    return scene


def render_picture(path: Path, samples: int) -> None:
    """The densities side by side, rendered by Selenite, as PNG."""
    from selenite import native
    from selenite.scene_read.build import build as build_native
    from selenite.scene_read.scene import read_scene

    pictures = []
    for density in DENSITIES:
        scene = build_native(read_scene(build(density)))
        pictures.append(native.core().render(scene, "Front", *SIZE, samples, seed=1).image)
    native.image().write_png(str(path), np.ascontiguousarray(np.concatenate(pictures, axis=1)))


def main(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--save", type=Path, help="write the scene here (.blend)")
    parser.add_argument("--picture", type=Path, help="render the guide's picture (.png)")
    parser.add_argument("--spp", type=int, default=300, help="samples of the picture")
    options = parser.parse_args(arguments)
    if options.save:
        build(DENSITIES[1])
        bpy.ops.wm.save_as_mainfile(filepath=str(options.save.resolve()), check_existing=False)
    if options.picture:
        render_picture(options.picture.resolve(), options.spp)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
