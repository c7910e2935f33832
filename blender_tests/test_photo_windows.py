# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos with a size, crop and pixel aspect of their own are rendered as Cycles renders them."""

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import read_captures
from selenite.capture.request import CaptureRequest
from selenite.capture.window import cropped_camera
from selenite.cycles_check.compare import Estimate
from selenite.cycles_check.render import estimate
from selenite.cycles_check.render_settings import set_comparison
from selenite.fit.plan import build_scene
from selenite.scene_read.camera import read_camera
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

FITS = ("AUTO", "HORIZONTAL", "VERTICAL")


@pytest.fixture
def values():
    """A ball with a rim against the sky, a lamp's highlight, a camera with a shift: 32 x 24."""
    made.studio(base_color=(0.8, 0.2, 0.1), roughness=0.3)
    made.light("Key", energy=60)
    bpy.data.objects["Camera"].data.shift_x = 0.04
    bpy.data.objects["Camera"].data.shift_y = -0.03
    return read_scene(bpy.context.scene)


def capture_of(values, path, pixels, height, **asked):
    problems = []
    request = CaptureRequest("Camera", str(made.photo(path, pixels)), **asked)
    found = read_captures(values, [request], height, problems, [], {})
    assert not problems, problems
    return found[0]


def ours(values, capture, spp=4096):
    rows, columns = capture.reference.shape[:2]
    film = native.core().render(
        build_scene(values), "Camera", columns, rows, spp, seed=1, frame=capture.frame
    )
    return Estimate.of_film(film)


def cycles(size, tmp_path, border=None, pixel_aspect=1.0, samples=128):
    """Cycles at (width, height), of which a part (x0, y0, x1, y1) from the top left is rendered."""
    scene, pictures = bpy.context.scene, []
    for seed in range(4):
        set_comparison(scene, samples, seed)
        render = scene.render
        render.resolution_x, render.resolution_y, render.resolution_percentage = *size, 100
        render.pixel_aspect_x, render.pixel_aspect_y = pixel_aspect, 1.0
        if border is not None:
            render.use_border = render.use_crop_to_border = True
            left, top, right, bottom = border
            render.border_min_x, render.border_max_x = left / size[0], right / size[0]
            render.border_min_y, render.border_max_y = 1 - bottom / size[1], 1 - top / size[1]
        image = render.image_settings
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        render.use_file_extension = False
        render.filepath = str(tmp_path / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        pictures.append(native.image().read(render.filepath)[0])
    return Estimate.of_seeds(pictures)


def distance(one, other):
    """Root mean square over that of its noise: 1 if they are estimates of the same picture."""
    noise = one.variance + other.variance
    return np.sqrt(((one.mean - other.mean) ** 2).mean() / noise.mean())


@pytest.mark.parametrize("fit", FITS)
def test_a_portrait_photo_is_what_blender_renders_at_its_size(values, tmp_path, fit):
    bpy.data.objects["Camera"].data.sensor_fit = fit
    values = read_scene(bpy.context.scene)
    capture = capture_of(values, tmp_path / "photo.exr", (18, 30), 30, size=(18, 30))
    expected = cycles((18, 30), tmp_path)
    assert distance(ours(values, capture), expected) < 1.6


def test_a_crop_is_what_blender_renders_inside_of_a_border(values, tmp_path):
    border = (6, 10, 26, 34)
    capture = capture_of(values, tmp_path / "photo.exr", (20, 24), 24, size=(40, 60), crop=border)
    assert capture.reference.shape == (24, 20, 3)
    expected = cycles((40, 60), tmp_path, border)
    assert distance(ours(values, capture), expected) < 1.6
    # A pixel beside is another picture.
    neighbour = capture_of(
        values, tmp_path / "photo.exr", (20, 24), 24, size=(40, 60), crop=(7, 10, 27, 34)
    )
    assert distance(ours(values, neighbour), expected) > 4


def test_a_photo_may_have_wider_pixels_than_the_scene(values, tmp_path):
    capture = capture_of(values, tmp_path / "photo.exr", (20, 30), 30, pixel_aspect=1.5)
    expected = cycles((20, 30), tmp_path, pixel_aspect=1.5)
    assert distance(ours(values, capture), expected) < 1.6


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_the_check_in_cycles_renders_the_crop(values, tmp_path, kind):
    bpy.data.objects["Camera"].data.type = kind
    values = read_scene(bpy.context.scene)
    capture = capture_of(
        values, tmp_path / "photo.exr", (20, 24), 17, size=(40, 60), crop=(6, 10, 26, 34)
    )
    rows, columns = capture.reference.shape[:2]
    (camera,) = values.cameras
    before = read_camera(
        bpy.data.objects["Camera"].evaluated_get(bpy.context.evaluated_depsgraph_get()),
        "Camera", bpy.context.scene,
    )  # fmt: skip
    for _ in range(2):  # a photo of the same camera before it does not matter
        shown = estimate(
            bpy.context.scene,
            cropped_camera(camera, capture.aspect, capture.window),
            (columns, rows), 128, range(4), tmp_path / "c.exr",
            pixel_aspect=capture.pixel_aspect(camera),
        )  # fmt: skip
    film = native.core().render(
        build_scene(values), "Camera", columns, rows, 4096, seed=1, frame=capture.frame_of_render
    )
    assert distance(Estimate.of_film(film), shown) < 1.6
    assert camera.lens_mm == before.lens_mm


@pytest.mark.parametrize("window", [(0.5, 0, 0.5, 1), (-0.1, 0, 1, 1), (0, 0, 1, 1.1)])
def test_what_is_no_window_is_refused(values, window):
    with pytest.raises(ValueError, match=r"Photo frame: window \(.*\) is not permitted; set left"):
        native.core().render(build_scene(values), "Camera", 8, 8, 1, frame=(1.0, 0, 0, window))
