# SPDX-License-Identifier: GPL-3.0-or-later
"""A render that is compared with a photo is one of the photo: brought to a size at which its width
is no whole number and its pixels are cut."""

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import read_captures
from selenite.capture.request import CaptureRequest
from selenite.cli import main
from selenite.cycles_check.compare import Estimate
from selenite.cycles_check.render import estimate
from selenite.fit.plan import build_scene
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.fixture
def values():
    """A ball with a rim against the sky and a lamp's highlight; the camera takes 32 x 24."""
    made.studio(base_color=(0.8, 0.2, 0.1), roughness=0.3)
    made.light("Key", energy=60)
    return read_scene(bpy.context.scene)


def capture_of(values, path, size, height):
    wanted = (CaptureRequest("Camera", str(made.photo(path, size))),)
    (capture,) = read_captures(values, wanted, height, [], [], {})
    return capture


def rendered(values, size, spp=8192, **how):
    """Mean and variance of a picture of (width, height)."""
    film = native.core().render(build_scene(values), "Camera", *size, spp, **{"seed": 1} | how)
    return Estimate.of_film(film)


def distance(one, other):
    """Root mean square over that of its noise: 1 if they are estimates of the same picture."""
    noise = one.variance + other.variance
    return np.sqrt(((one.mean - other.mean) ** 2).mean() / noise.mean())


@pytest.mark.parametrize(
    "size, height, spp",
    [((32, 24), 16, 1024), ((64, 48), 16, 8192), ((80, 60), 25, 4096), ((41, 31), 24, 2048)],
)
def test_a_render_is_that_of_the_photo(values, tmp_path, size, height, spp):
    """spp: so many that another frame is 2.7 standard deviations away, or more."""
    capture = capture_of(values, tmp_path / "photo.exr", size, height)
    rows, columns = capture.reference.shape[:2]
    share = columns * rows / (size[0] * size[1])
    # What a photo is: the whole of what the camera takes in so many pixels. With twice the samples
    # of the small picture it adds little noise.
    photo = rendered(values, size, int(spp * min(1.0, 2 * share)), seed=2, frame=(32 / 24, 0, 0))
    # With equal weights the variances of cut pixels would not add up; they are not far from it.
    planes = np.dstack([photo.mean, photo.variance]).astype(np.float32)
    small = native.image().resize(np.ascontiguousarray(planes), columns, rows)
    reference = Estimate(small[..., :3], small[..., 3:] * min(1.0, share))
    assert distance(rendered(values, (columns, rows), spp, frame=capture.frame), reference) < 1.2
    # Neither of these is it.
    for frame in ((0.0, 0, 0), (32 / 24, 0, 0)):
        assert distance(rendered(values, (columns, rows), spp, frame=frame), reference) > 2


def test_whole_sizes_stay_as_they_are(values, tmp_path):
    capture = capture_of(values, tmp_path / "photo.exr", (64, 48), 24)
    with_photo = rendered(values, (32, 24), spp=4, frame=capture.frame)
    assert (with_photo.mean == rendered(values, (32, 24), spp=4).mean).all()


def test_cycles_takes_the_same_frame(values, tmp_path):
    """32 x 24 at a height of 5 is 6.7 wide, so 7: narrower pixels, in both renderers."""
    capture = capture_of(values, tmp_path / "photo.exr", (32, 24), 5)
    assert capture.reference.shape == (5, 7, 3)
    aspect = capture.pixel_aspect(values.cameras[0])
    assert aspect == pytest.approx((32 / 24) / (7 / 5))
    cycles = estimate(
        bpy.context.scene, "Camera", (7, 5), 256, range(4), tmp_path / "c.exr", pixel_aspect=aspect
    )
    same, square = (
        rendered(values, (7, 5), frame=frame) for frame in ((capture.aspect, 0, 0), (0.0, 0, 0))
    )
    assert distance(same, cycles) < 2
    assert distance(square, cycles) > 4


def test_one_given_side_shows_the_whole_frame(values, tmp_path):
    """`selenite render --height` of a photo and a fit at that height agree about what is in it."""
    path, out = made.save(tmp_path / "scene.blend"), tmp_path / "p.exr"
    words = ["render", path, "--out", str(out), "--spp", "64", "--height", "16"]
    assert main(words) == 0
    whole = native.image().read(str(out))[0]
    assert whole.shape == (16, 21, 3)
    frame = (32 / 24, 0, 0)
    expected = rendered(read_scene(bpy.context.scene), (21, 16), spp=64, seed=0, frame=frame)
    np.testing.assert_array_equal(whole, expected.mean.astype(np.float32))
    assert main([*words, "--width", "21"]) == 0
    assert not (native.image().read(str(out))[0] == whole).all()


@pytest.mark.parametrize("frame", [(-1.0, 0, 0), (float("nan"), 0, 0), (1.0, -3, 2)])
def test_what_is_no_frame_is_refused(values, frame):
    with pytest.raises(ValueError, match="Photo frame: .* is not permitted; set"):
        rendered(values, (8, 8), spp=1, frame=frame)
