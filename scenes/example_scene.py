# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scene scripts share: reference photos by Cycles, and the command line.

The settings of the renders are the add-on's (`selenite.cycles_check.render_settings`), found from
a script that runs in a Blender where the add-on is not installed.
"""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy

ADDON = Path(__file__).resolve().parents[1] / "addon"
if str(ADDON) not in sys.path:
    sys.path.insert(0, str(ADDON))

from selenite.cycles_check.render_settings import set_comparison  # noqa: E402

__all__ = ["Example", "principled", "set_comparison"]

#: Both generations of names.
SOCKETS = {
    "base_color": ("Base Color",),
    "roughness": ("Roughness",),
    "transmission": ("Transmission Weight", "Transmission"),
    "ior": ("IOR",),
    "specular_level": ("Specular IOR Level", "Specular"),
}


def principled(name: str, values: dict) -> bpy.types.Material:
    """Material with one Principled BSDF holding `values` (parameter name -> number or colour)."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    for parameter, value in values.items():
        socket = next(node.inputs[s] for s in SOCKETS[parameter] if s in node.inputs)
        socket.default_value = (*value, 1.0) if isinstance(value, tuple) else value
    return material


class Example:
    """A scene with a known material.

    build: replaces the open file by the scene with the given parameters of `material`.
    """

    def __init__(
        self,
        description: str,
        build: Callable[[dict[str, Any]], bpy.types.Scene],
        material: str,
        cameras: list[str],
        truth: dict[str, Any],
        start: dict[str, Any],
    ) -> None:
        self.description = description
        self.build = build
        self.material = material
        self.cameras = cameras
        self.truth = truth
        self.start = start

    def render_photos(self, folder: Path, samples: int) -> None:
        """Reference photos at the true values: PNG at full size, EXR (half float) at half size."""
        folder.mkdir(parents=True, exist_ok=True)
        scene = self.build(self.truth)
        image = scene.render.image_settings
        for seed, camera in enumerate(self.cameras):
            scene.camera = bpy.data.objects[camera]
            for percentage, file_format, depth, suffix in (
                (100, "PNG", "8", ".png"),
                (50, "OPEN_EXR", "16", ".exr"),
            ):
                set_comparison(scene, samples, seed=seed)
                scene.render.resolution_percentage = percentage
                image.file_format = file_format
                image.color_mode = "RGB"
                image.color_depth = depth
                if file_format == "OPEN_EXR":
                    image.exr_codec = "ZIP"
                scene.render.filepath = str(folder / (camera + suffix))
                bpy.ops.render.render(write_still=True)
        truth = {"material": self.material, "parameters": self.truth, "cameras": self.cameras}
        (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")

    def save_start(self, path: Path) -> None:
        """Writes the scene with the start values as a .blend file."""
        self.build(self.start)
        body = next(
            item
            for item in bpy.data.objects
            if any(slot.material and slot.material.name == self.material
                   for slot in item.material_slots)
        )  # fmt: skip
        for item in bpy.context.view_layer.objects:
            item.select_set(item == body)
        bpy.context.view_layer.objects.active = body  # what is to be fitted
        bpy.ops.wm.save_as_mainfile(filepath=str(path.resolve()), check_existing=False)

    def main(self) -> None:
        """The command line of a scene script, in Python or behind Blender's `--`."""
        rest = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
        parser = argparse.ArgumentParser(description=self.description)
        parser.add_argument("--save", type=Path, help="write the scene with the start values here")
        parser.add_argument(
            "--photos", type=Path, help="render the reference photos into this folder"
        )
        parser.add_argument("--spp", type=int, default=512, help="samples of the photos")
        options = parser.parse_args(rest)
        if options.save:
            self.save_start(options.save)
        if options.photos:
            self.render_photos(options.photos.resolve(), options.spp)
