# SPDX-License-Identifier: GPL-3.0-or-later
"""`selenite fit --fit Ball:vertex_positions`: from photos to a shape key and its file."""

import json
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.importers import mesh_repair
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build
from selenite.write_back import vertex_positions

pytestmark = pytest.mark.blender

NAME = "Ball:vertex_positions"


def ball():
    """A ball of 162 vertices before a bright world, seen from one side."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.5)
    item = bpy.context.object
    item.name = "Ball"
    for polygon in item.data.polygons:
        polygon.use_smooth = True
    item.data.materials.append(made.material(base_color=(0.1, 0.1, 0.1), roughness=1.0))
    made.world(strength=1.0, color=(0.8, 0.8, 0.8))
    camera = made.camera(distance=2.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 24
    return item


def vertices_of(item):
    return np.array([vertex.co for vertex in item.data.vertices], np.float32)


def requested(**values):
    """The field that is asked for so, or what is wrong."""
    problems = []
    found = fields.choose(
        made.read(), [UnknownRequest(*NAME.split(":"), **values)], [], FitSettings(), problems
    )
    return found[0] if found else str([item.line() for item in problems])


def photo_of_larger(item, folder, size=24):
    """A photo of the ball with 1.3 times its size."""
    scene = build(made.read()).with_vertices("Ball", 1.3 * vertices_of(item))
    film = native.core().render(scene, "Camera", size, size, 512, seed=99)
    native.image().write_exr(str(folder / "photo.exr"), film.image)
    return str(folder / "photo.exr")


def test_a_fit_finds_the_shape_and_the_saved_scene_has_it(tmp_path, capsys):
    item = ball()
    start, photo = vertices_of(item), photo_of_larger(item, tmp_path)
    path, saved = made.save(tmp_path / "scene.blend"), tmp_path / "fitted.blend"
    options = (
        "--photo", f"Camera={photo}", "--height", "24", "--threads", "1", "--iterations", "40",
        "--spp", "8", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    status, report, _ = command(capsys, "fit", path, "--fit", NAME, *options, "--save", str(saved))
    assert status == 0, report
    row = report["parameters"][NAME]
    assert row["vertices"] == len(start) and row["mean_distance_moved"] > 0.05
    found = np.load(f"{report['folder']}/Ball_vertex_positions.npy")
    assert found.shape == start.shape
    # The outline that the camera sees has the radius of the photo's ball.
    outline = np.abs(start[:, 2]) < 0.2
    assert np.linalg.norm(found[outline][:, :2], axis=1).max() == pytest.approx(0.65, abs=0.05)
    assert report["loss"]["result"] < 0.1 * report["loss"]["start"]
    text = Path(report["folder"], "Ball_vertex_positions.obj").read_text()
    assert text.count("\nv ") == len(start)

    open_blend(str(saved))
    ball_there = bpy.data.objects["Ball"]
    keys = ball_there.data.shape_keys.key_blocks
    assert [key.name for key in keys] == ["Basis", "Selenite"] and keys["Selenite"].value == 1
    shown = np.array([point.co for point in keys["Selenite"].data])
    np.testing.assert_allclose(shown, found, atol=1e-6)
    np.testing.assert_allclose(made.read().meshes[0].positions, found, atol=1e-5)
    vertex_positions.restore("Ball")
    assert ball_there.data.shape_keys is None
    np.testing.assert_allclose(vertices_of(ball_there), start, atol=1e-6)

    # A second fit begins at the shape.
    status, second, _ = command(
        capsys, "fit", path, "--start", report["folder"], "--fit", "Body:roughness", *options
    )
    assert status == 0, second
    assert second["loss"]["start"] < 0.2 * report["loss"]["start"]


def test_the_slope_of_a_squared_error_is_linear_in_the_photo():
    ball()
    core = native.core()
    evaluator = core.Evaluator(build(made.read()), threads=1)

    def slopes(loss, value):
        photo = core.Photo("Camera", np.full((24, 24, 3), value, np.float32))
        _, found = evaluator.gradient(photo, "Ball", "vertex_positions", 8, loss=loss, seed=3)
        return found

    mean = slopes("mean", 0.3)
    low, high = (slopes("squared_error", value) for value in (0.25, 0.5))
    np.testing.assert_allclose(low - high, 2 * (0.5 - 0.25) * mean, atol=1e-4 * abs(mean).max())


def test_what_cannot_be_fitted_is_named():
    item = ball()
    assert requested().values.shape == (len(item.data.vertices), 3)
    assert "not at one value" in requested(start=(0.5,))
    assert "bounding box" in requested(minimum=0.1)
    assert "learning rate" in requested(learning_rate=2.0)
    assert "cannot be read" in requested(grid="/nowhere.npy")
    assert "no object" in str(
        [problem.line() for problem in _problems(UnknownRequest("Nobody", "vertex_positions"))]
    )
    twin = item.copy()
    bpy.context.scene.collection.objects.link(twin)
    assert "single user" in requested()
    bpy.data.objects.remove(twin)
    item.modifiers.new("Bend", "SIMPLE_DEFORM")
    assert "modifiers" in requested()


def _problems(request):
    problems = []
    fields.choose(made.read(), [request], [], FitSettings(), problems)
    return problems


def test_a_shape_and_a_colour_take_turns(tmp_path, capsys):
    item = ball()
    start = vertices_of(item)
    colour = f"{item.data.materials[0].name}:base_color"
    made.socket(item.data.materials[0], "base_color").default_value = (0.2, 0.3, 0.4, 1.0)
    photo = photo_of_larger(item, tmp_path)
    made.socket(item.data.materials[0], "base_color").default_value = (0.1, 0.1, 0.1, 1.0)
    status, report, _ = command(
        capsys, "fit", made.save(tmp_path / "scene.blend"), "--fit", NAME, "--fit", colour,
        "--photo", f"Camera={photo}", "--height", "24", "--threads", "1", "--iterations", "40",
        "--spp", "8", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    assert status == 0, report
    assert [stage["name"] for stage in report["stages"]] == [
        "start of the rest", "shape of Ball", "rest", "together 1: shape of Ball",
        "together 1: rest", "together 2: shape of Ball", "together 2: rest",
    ]  # fmt: skip
    assert [stage["parameters"] for stage in report["stages"]] == [[colour], [NAME]] * 3 + [
        [colour]
    ]
    assert any("moves while all else keeps" in text for text in report["warnings"])
    assert report["parameters"][NAME]["mean_distance_moved"] > 0.05
    fitted = report["parameters"][colour]
    np.testing.assert_allclose(fitted["value"], (0.2, 0.3, 0.4), atol=0.03)
    assert fitted["interval_90"] is not None
    found = np.load(f"{report['folder']}/Ball_vertex_positions.npy")
    outline = np.abs(start[:, 2]) < 0.2
    assert np.linalg.norm(found[outline][:, :2], axis=1).max() == pytest.approx(0.65, abs=0.05)


def test_masks_say_where_the_outline_is(tmp_path, capsys):
    """The mask hides all but the inside of the object: it alone tells how large that is."""
    item = ball()
    start, photo = vertices_of(item), photo_of_larger(item, tmp_path, 96)
    scene = build(made.read()).with_vertices("Ball", 1.3 * start)
    seen = native.core().render(scene, "Camera", 96, 96, 16, seed=3).image[..., :1]
    world = float(seen[0, 0, 0])
    mask = str(tmp_path / "mask.png")
    inside = np.repeat((seen < 0.6 * world).astype(np.float32), 3, axis=2)
    native.image().write_png(mask, inside)
    captures = tmp_path / "captures.json"
    captures.write_text(
        json.dumps({"schema": 1, "captures": [{"camera": "Camera", "photo": photo, "mask": mask}]})
    )
    status, report, _ = command(
        capsys, "fit", made.save(tmp_path / "scene.blend"), "--fit", NAME,
        "--captures", str(captures), "--height", "24", "--threads", "1", "--iterations", "100",
        "--spp", "8", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    assert status == 0, report
    found = np.load(f"{report['folder']}/Ball_vertex_positions.npy")
    outline = np.abs(start[:, 2]) < 0.2
    assert np.linalg.norm(found[outline][:, :2], axis=1).max() == pytest.approx(0.65, abs=0.05)


def test_a_shape_key_goes_on_top_of_others(tmp_path):
    item = ball()
    item.shape_key_add(name="Basis")
    wide = item.shape_key_add(name="Wide")
    start = vertices_of(item)
    wide.data.foreach_set("co", (start * (1.4, 1, 1)).astype(np.float32).ravel())
    wide.value = 0.5
    values = made.read()
    np.testing.assert_allclose(values.meshes[0].positions, start * (1.2, 1, 1), atol=1e-6)
    wanted = (start * (1.2, 1, 1.1)).astype(np.float32)
    np.save(tmp_path / "shape.npy", wanted)
    vertex_positions.show(values, "Ball", str(tmp_path / "shape.npy"))
    np.testing.assert_allclose(made.read().meshes[0].positions, wanted, atol=1e-5)
    vertex_positions.restore("Ball")
    assert [key.name for key in item.data.shape_keys.key_blocks] == ["Basis", "Wide"]


def test_a_remesh_takes_the_fitted_shape_with_it(tmp_path):
    """For a second fit, with other vertices."""
    item = ball()
    start = vertices_of(item)
    np.save(tmp_path / "shape.npy", (start * (1.4, 1, 1)).astype(np.float32))
    vertex_positions.show(made.read(), "Ball", str(tmp_path / "shape.npy"))
    mesh_repair.remesh(item, 0.05)
    assert item.data.shape_keys is None
    assert np.ptp(vertices_of(item), axis=0) == pytest.approx((1.4, 1, 1), abs=0.06)
    assert requested().values.shape == (len(item.data.vertices), 3)
