# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles settings under which a render is an unbiased estimate of what the materials say.

The factory settings are not: they clamp, filter, denoise and end paths early (manual, "What you fit
is what Cycles renders").
"""

from pathlib import Path

import bpy


def set_comparison(scene: bpy.types.Scene, samples: int, seed: int = 0) -> None:
    """Box filter, no denoising, no clamping, practically unlimited bounces."""
    scene.render.engine = "CYCLES"
    scene.render.film_transparent = False
    scene.render.dither_intensity = 0
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples = samples
    cycles.seed = seed
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.use_light_tree = True
    cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type = "BOX"
    cycles.film_exposure = 1
    cycles.blur_glossy = 0
    cycles.sample_clamp_direct = 0
    cycles.sample_clamp_indirect = 0
    cycles.caustics_reflective = True
    cycles.caustics_refractive = True
    cycles.use_fast_gi = False
    for limit in (
        "max_bounces",
        "diffuse_bounces",
        "glossy_bounces",
        "transmission_bounces",
        "volume_bounces",
        "transparent_max_bounces",
    ):
        setattr(cycles, limit, 1024)
    for item in scene.objects:
        if item.type == "MESH" and hasattr(item, "cycles"):
            item.cycles.shadow_terminator_geometry_offset = 0
    view = scene.view_settings
    scene.display_settings.display_device = "sRGB"
    view.view_transform = "Standard"
    view.look = "None"
    view.exposure = 0
    view.gamma = 1


def render_cameras(
    blend: Path, cameras: list[str], size: tuple[int, int], folder: Path, samples: int
) -> dict[str, Path]:
    """Renders a saved file with Cycles from some of its cameras; returns camera -> OpenEXR file.

    Opens `blend`; pictures are `size` (width, height) pixels, 32-bit float, scene-linear.
    """
    bpy.ops.wm.open_mainfile(filepath=str(blend), load_ui=False)
    scene = bpy.context.scene
    set_comparison(scene, samples)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    image = scene.render.image_settings
    image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
    pictures = {}
    for name in cameras:
        scene.camera = bpy.data.objects[name]
        pictures[name] = folder / f"{name}_cycles.exr"
        scene.render.filepath = str(pictures[name])
        bpy.ops.render.render(write_still=True)
    return pictures
