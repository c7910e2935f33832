# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks that need the scene: silhouettes of what is fitted, and backgrounds that are not its."""

import bpy
import made_scenes as made
import numpy as np
import pytest

from selenite import native
from selenite.capture.prepared import read_captures
from selenite.capture.request import CaptureRequest
from selenite.fit.plan import build_scene, prepare
from selenite.fit.request import RunRequest, UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.problems import BadInput
from selenite.scene_read.scene import read_scene

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.fixture
def values():
    """A ball of one material, half covered by a block of another that stands nearer."""
    made.studio(base_color=(0.8, 0.2, 0.1), roughness=0.6)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(1.0, 0.0, 1.5))
    bpy.context.object.name = "Block"
    bpy.context.object.data.materials.append(made.material("Block"))
    return read_scene(bpy.context.scene)


def photo(values, path, size=(32, 24), black=False):
    """What the camera renders; its sky, where nothing is hit, black if asked for."""
    film = native.core().render(build_scene(values), "Camera", *size, 256, seed=3)
    pixels = film.image.copy()
    if black:
        pixels[~(hits(values, size)[..., None] > 0).any(axis=-1)] = 0
    native.image().write_exr(str(path), np.ascontiguousarray(pixels))
    return str(path)


def hits(values, size, material=None):
    """Share of 4 x 4 rays of each pixel that first meet the material, by Blender's ray cast."""
    graph = bpy.context.evaluated_depsgraph_get()
    (camera,) = (item for item in values.cameras if item.name == "Camera")
    found = np.zeros((size[1], size[0]))
    steps = 4
    unit = 36 / camera.lens_mm / size[0]  # AUTO, wider than high
    rotation, origin = camera.matrix[:3, :3], camera.matrix[:3, 3]
    for y in range(size[1] * steps):
        for x in range(size[0] * steps):
            across = ((x + 0.5) / steps - size[0] / 2) * unit
            down = ((y + 0.5) / steps - size[1] / 2) * unit
            way = rotation @ np.array([across, -down, -1.0])
            hit, _, _, index, item, _ = bpy.context.scene.ray_cast(graph, origin, way)
            if hit and (material is None or item.data.materials[0].name == material):
                found[y // steps, x // steps] += 1 / steps**2
    return found


def capture_of(values, path, fitted, **asked):
    problems = []
    request = CaptureRequest("Camera", path, **asked)
    found = read_captures(values, [request], 24, problems, [], {}, fitted)
    assert not problems
    return found[0]


def test_a_silhouette_is_what_the_camera_sees_of_the_fitted_object(values, tmp_path):
    path = photo(values, tmp_path / "photo.exr")
    seen = capture_of(values, path, {"Body"}, silhouette=0).weight > 0
    share = hits(values, (32, 24), "Body")
    # The rim is taken off: what counts is wholly on the ball, as are its neighbours.
    padded = np.pad(share, 1, constant_values=1)
    least = np.min([padded[y : y + 24, x : x + 32] for y in range(3) for x in range(3)], axis=0)
    assert seen.sum() > 40
    assert (least[seen] > 0.99).all()
    missed = (least == 1) & ~seen
    assert missed.sum() <= 0.05 * seen.sum(), "but for what coarser rays took for whole"
    assert seen.sum() < (hits(values, (32, 24)) > 0.99).sum(), "the block covers a part"


def test_a_silhouette_is_eroded(values, tmp_path):
    path = photo(values, tmp_path / "photo.exr")
    counts = [
        (capture_of(values, path, {"Body"}, silhouette=count).weight > 0).sum()
        for count in (0, 1, 2)
    ]
    assert counts[0] > counts[1] > counts[2] > 0


def test_without_a_fitted_material_all_surfaces_are_the_object(values, tmp_path):
    path = photo(values, tmp_path / "photo.exr")
    everything = capture_of(values, path, {"World"}, silhouette=0).weight > 0
    assert everything.sum() > (capture_of(values, path, {"Body"}, silhouette=0).weight > 0).sum()
    assert (hits(values, (32, 24))[everything] > 0.99).all()


def request(path, **asked):
    unknowns = (UnknownRequest("Body", "base_color"),)
    settings = FitSettings(height=24, iterations=2, spp=4, picture_spp=4, search="off")
    return RunRequest("", unknowns, (CaptureRequest("Camera", path, **asked),), settings)


def test_a_camera_that_sees_nothing_of_the_object_is_a_problem(values, tmp_path):
    path = photo(values, tmp_path / "photo.exr")
    bpy.data.objects["Body"].location = (0, 0, 50)
    with pytest.raises(BadInput, match="sees nothing of the fitted objects"):
        prepare(read_scene(bpy.context.scene), request(path, silhouette=1))


@pytest.mark.parametrize("black, said", [(True, 1), (False, 0)])
def test_a_black_background_that_counts_is_named(values, tmp_path, black, said):
    path = photo(values, tmp_path / "photo.exr", black=black)
    plan = prepare(values, request(path))
    found = [text for text in plan.warnings if "up to its border, is black" in text]
    assert len(found) == said
    for text in found:
        assert text.startswith(f"Photo '{path}'") and "silhouette" in text
    # A mask, of any kind, is the cure.
    for asked in ({"silhouette": 0}, {"background": "border:0.02"}):
        plan = prepare(values, request(path, **asked))
        assert not [text for text in plan.warnings if "up to its border" in text]


def test_a_black_background_of_a_black_world_is_none(tmp_path):
    made.studio(base_color=(0.8, 0.2, 0.1), roughness=0.6)
    made.world(strength=0.0)
    made.light("Key", energy=200)
    values = read_scene(bpy.context.scene)
    plan = prepare(values, request(photo(values, tmp_path / "photo.exr")))
    assert not [text for text in plan.warnings if "up to its border" in text]


def test_a_white_background_of_a_grey_world_is_named(values, tmp_path):
    path = photo(values, tmp_path / "photo.exr")
    pixels = native.image().read(path)[0].copy()
    pixels[hits(values, (32, 24)) == 0] = 0.97
    native.image().write_exr(path, pixels)
    plan = prepare(values, request(path))
    assert [text for text in plan.warnings if "is of one brightness, 0.97" in text]


@pytest.mark.parametrize("asked", [{"silhouette": 1}, {"background": "border:0.02"}])
def test_a_masked_background_does_not_matter(values, tmp_path, asked):
    """Black, white or grey: a fit is given the same, bit by bit. Noise needs a silhouette."""
    plain = photo(values, tmp_path / "plain.exr")
    behind = hits(values, (32, 24)) == 0
    given = []
    noise = np.random.default_rng(5).random((24, 32, 3))
    for index, background in enumerate((0.0, 1.9, 0.18, noise)):
        if index == 3 and "silhouette" not in asked:
            continue
        pixels = native.image().read(plain)[0].copy()
        pixels[behind] = (noise if index == 3 else np.full_like(noise, background))[behind]
        path = str(tmp_path / f"{index}.exr")
        native.image().write_exr(path, np.ascontiguousarray(pixels, np.float32))
        found = capture_of(values, path, {"Body", "Block"}, **asked)
        given.append((found.weight, np.where((found.weight > 0)[..., None], found.reference, 0)))
    for weight, reference in given:
        assert (weight > 0).sum() > 80
        np.testing.assert_array_equal(weight, given[0][0])
        np.testing.assert_array_equal(reference, given[0][1])
