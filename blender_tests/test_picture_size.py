# SPDX-License-Identifier: GPL-3.0-or-later
"""The size of a picture: percentages as Blender rounds them, and the render region."""

import bpy
import made_scenes as made
import pytest

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.mark.parametrize(
    ("size", "percentage"),
    [((100, 50), 29), ((100, 70), 57), ((50, 100), 58), ((33, 47), 101), ((4, 70), 29)],
)
def test_sizes_at_a_percentage_are_those_of_blenders_own_renders(
    native, tmp_path, size, percentage
):
    made.camera()
    made.triangle()
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = percentage
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "size.exr")
    bpy.ops.render.render(write_still=True)
    info = native.image().probe(scene.render.filepath)
    camera = made.read().cameras[0]
    assert (camera.width, camera.height) == (info["width"], info["height"])


def test_a_render_that_is_cropped_to_its_region_is_refused_by_name():
    made.studio()
    render = bpy.context.scene.render
    render.use_border, render.use_crop_to_border = True, False
    values = made.read()
    assert not values.problems and any("render region" in text for text in values.warnings)
    render.use_crop_to_border = True
    (problem,) = made.read().problems
    assert problem.object == "Scene 'Scene'" and "crop" in problem.cause
    render.use_border = False
    assert not made.read().problems
