# SPDX-License-Identifier: GPL-3.0-or-later
"""Where World:environment starts, and what is refused."""

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.environments import sphere
from selenite.fit import fields
from selenite.fit.diagnosis import gauge
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.fit.unknowns import choose
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender


def requested(with_them=(), owner="World", **values):
    """The image of the open scene that is asked for so, or what is wrong."""
    scene, problems = made.read(), []
    others = choose(
        scene, [UnknownRequest(*item) for item in with_them], FitSettings(), problems, []
    )
    request = UnknownRequest(owner, "environment", **values)
    found = fields.choose(scene, [request], others, FitSettings(), problems)
    return found[0] if found and not problems else str([item.line() for item in problems])


def sky(rows=32, rotation=(0.0, 0.0, 0.0), peak=900.0):
    """A scene whose world is a noisy sky with a small sun; its pixels."""
    made.studio()
    pixels = np.random.default_rng(0).random((rows, 2 * rows, 3)).astype(np.float32)
    pixels[rows // 4, rows // 2] = peak
    made.environment(bpy.context.scene.world, pixels, rotation)
    return pixels


def picture(path, pixels):
    write = native.image().write_exr if path.suffix == ".exr" else native.image().write_png
    write(str(path), np.ascontiguousarray(pixels, np.float32))
    return str(path)


def test_one_colour_goes_into_the_image_and_the_strength_stays():
    made.studio()
    made.world(color=(0.2, 0.4, 0.6), strength=3.0)
    field = requested()
    assert field.values.shape == (16, 32, 3) and field.values.dtype == np.float32
    np.testing.assert_allclose(field.values.reshape(-1, 3), [(0.2, 0.4, 0.6)] * 512, rtol=1e-6)
    assert (field.minimum, field.maximum) == (0, pytest.approx(1e4 / 3))
    assert not field.notes
    world = field.in_scene(made.read()).world
    assert (world.color, world.strength) == ((1, 1, 1), 3.0)
    row = field.native()
    assert (row.owner, row.parameter) == ("World", "environment")
    assert row.learning_rate == pytest.approx(0.03 * 0.4)


@pytest.mark.parametrize(("size", "shape"), [(8, (2, 4)), (128, (8, 16)), (2048, (32, 64))])
def test_the_size_is_that_of_the_nearest_grid(size, shape):
    made.studio()
    assert requested(size=size).values.shape == (*shape, 3)
    assert requested(grid=str(size)).values.shape == (*shape, 3)
    assert requested(size=size).request.size == shape[0] * shape[1]


def test_a_scene_with_the_start_renders_as_before():
    """The same light, of which other paths are drawn."""
    made.studio()
    made.world(color=(0.2, 0.4, 0.6), strength=2.0)
    assert_same_picture(requested())
    sky(rows=8, peak=3.0)
    assert_same_picture(requested())


def assert_same_picture(field):
    pictures = [
        native.core().render(build(values), "Camera", 32, 24, 64, seed=5).image
        for values in (made.read(), field.in_scene(made.read()))
    ]
    means = [item.mean(axis=(0, 1)) for item in pictures]
    # 64 samples of 768 pixels: the means differ by less than 0.3 % with other random numbers.
    assert np.abs(means[1] / means[0] - 1).max() < 0.01


def test_an_image_is_filtered_down_with_its_sun_and_its_rotation():
    pixels = sky(rotation=(0.0, 0.0, 0.7))
    field = requested(size=128)
    assert field.values.shape == (8, 16, 3)
    assert sphere.mean(field.values) == pytest.approx(sphere.mean(pixels), rel=0.05)
    to_map = made.read().world.to_map
    sun = to_map.T @ sphere.directions(32, 64)[8, 16]
    place = np.unravel_index(field.values[..., 0].argmax(), (8, 16))
    assert place == tuple(int(x) for x in sphere.places(sun, 8, 16))
    np.testing.assert_allclose(field.in_scene(made.read()).world.to_map, np.eye(3))


def test_a_small_image_stays_as_it_is():
    pixels = sky(rows=8, peak=5.0)
    np.testing.assert_allclose(requested().values, pixels, rtol=1e-6)
    assert requested(size=32).values.shape == (4, 8, 3)


def test_a_black_world_starts_at_a_small_grey_that_is_told():
    made.studio()
    made.world(color=(0.0, 0.0, 0.0), strength=2.0)
    field = requested()
    np.testing.assert_allclose(field.values, 0.025)
    assert "starts at a grey of radiance 0.05" in fields.remarks([field], [])[0]


def test_a_file_is_the_start(tmp_path):
    made.studio()
    pixels = np.random.default_rng(1).random((32, 64, 3)).astype(np.float32)
    pixels[10, 20] = 400
    path = picture(tmp_path / "room.exr", pixels)
    field = requested(grid=path, size=512)
    assert field.values.shape == (16, 32, 3) and not field.notes
    assert sphere.mean(field.values) == pytest.approx(sphere.mean(pixels), rel=1e-4)
    assert field.request.grid == path
    assert requested(grid=path).values.shape == (32, 64, 3)  # no more than a fit takes
    ball = picture(tmp_path / "ball.exr", np.full((40, 40, 3), 0.3))
    field = requested(grid=ball, projection="mirror_ball")
    np.testing.assert_allclose(field.values, 0.3, rtol=1e-5)


def test_panoramas_of_few_bits_are_told_as_clipped(tmp_path):
    made.studio()
    pixels = np.full((16, 32, 3), 0.2, np.float32)
    dark = requested(grid=picture(tmp_path / "dark.png", pixels))
    assert not dark.notes
    pixels[3, 4:8] = 1.0
    field = requested(grid=picture(tmp_path / "room.png", pixels))
    assert "'room.png' is clipped in 0.78 % of its pixels" in field.notes[0]
    np.testing.assert_allclose(field.values[0, 0], 0.2, atol=0.01)  # decoded
    made.environment(bpy.context.scene.world, pixels)
    assert "the image of the world, is clipped" in requested().notes[0]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"size": 4}, "its size is 4 texels; give 8 to 2048"),
        ({"grid": "4096"}, "its size is 4096 texels; give 8 to 2048"),
        ({"grid": "64", "size": 32}, "two sizes, 64 and 32; give one"),
        ({"grid": "/nowhere.exr"}, "cannot be read (it does not exist)"),
        ({"grid": "/nowhere.exr", "start": (0.5,)}, "two starts; give --start or a file"),
        ({"start": (-1.0,)}, "its start is -1; give 1 or 3 numbers from 0 up"),
        ({"projection": "mirror_ball"}, "none is given; add --environment FILE"),
        ({"unseen": "keep"}, "leave --unseen out"),
        ({"minimum": -1.0}, "bounds [-1, 10000] are not an interval of radiance; give bounds"),
        ({"learning_rate": 2.0}, "its learning rate is 2.0; give a number above 0"),
        ({"owner": "Body"}, "'Body' is not the world; call it World:environment"),
        ({"with_them": [("World", "color")]}, "takes the place of the one color, which is fitted"),
        (
            {"with_them": [("World", "strength")]},
            "only their product is seen; fit World:environment",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_cure(values, words):
    made.studio()
    assert words in requested(**values)


def test_files_of_another_shape_are_refused(tmp_path):
    made.studio()
    square = picture(tmp_path / "a.png", np.full((16, 16, 3), 0.5))
    wide = picture(tmp_path / "b.png", np.full((16, 32, 3), 0.5))
    assert "16 x 16 pixels are not twice as wide as high" in requested(grid=square)
    assert "crop the photo to a square" in requested(grid=wide, projection="mirror_ball")
    assert "its projection is 'fisheye'; give" in requested(grid=wide, projection="fisheye")


def test_worlds_that_cannot_take_an_image_are_refused():
    made.studio()
    world = bpy.context.scene.world
    background = next(n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Strength"].default_value = 0.0
    assert "strength of world 'Studio' is 0" in requested()
    assert "set its Strength to 1" in requested()
    world.use_nodes = False
    assert "does not use nodes; switch on Use Nodes" in requested()
    bpy.context.scene.world = None
    assert "the scene has no world; add one in World Properties" in requested()


def test_the_world_may_be_called_by_its_datablock():
    made.studio()
    assert requested(owner="Studio").name == "World:environment"


def test_a_request_survives_its_file():
    asked = UnknownRequest("World", "environment", grid="a.exr", size=128, projection="mirror_ball")
    request = RunRequest("scene.blend", (asked,))
    assert RunRequest.from_json(request.as_json()) == request


def test_the_gauge_is_told_where_nothing_is_known():
    made.studio()
    names = ["World:environment", "Body:base_color", "Body:roughness"]
    (text,) = gauge.remarks(made.read(), [], names)
    assert "World:environment and Body:base_color compensate for each other" in text
    assert "Add a grey card" in text
    assert not gauge.remarks(made.read(), [], names[1:])
    assert not gauge.remarks(made.read(), [], [names[0], names[2]])  # the colour is known
    made.light(energy=10.0)
    assert not gauge.remarks(made.read(), [], names)
    assert gauge.remarks(made.read(), [], [*names, "Key:power"])
    made.sphere("Card", made.material("Card"))
    assert not gauge.remarks(made.read(), [], [*names, "Key:power"])
