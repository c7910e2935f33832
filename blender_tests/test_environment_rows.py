# SPDX-License-Identifier: GPL-3.0-or-later
"""The image of the world in the panel: from a tick to an Environment Texture, and back."""

import json

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from drawn_panels import draw

from selenite import native
from selenite.interface import environment_panel, panels, request, state
from selenite.interface.rows import environment as environment_rows

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

NAME = "environment"


def row():
    return next(item for item in bpy.context.scene.selenite.rows if item.parameter == NAME)


def tick(**values):
    found = row()
    found.enabled = True
    for key, value in {"environment_size": 8, **values}.items():
        setattr(found, key, value)
    return found


@pytest.fixture
def settings(addon, tmp_path):
    """A ball under a grey world, with a photo; nothing is ticked."""
    made.studio(base_color=(0.5, 0.4, 0.3), roughness=0.5)
    made.sample_coarsely(bpy.context.scene.world)
    path = made.photo(tmp_path / "Camera.exr", value=0.15)
    found = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    found.captures[0].photo = bpy.data.images.load(str(path))
    found.height, found.iterations, found.tolerance = 16, 4, 0.0
    found.picture_spp, found.threads = 8, 1
    found.output = str(tmp_path / "out")
    return found


def world_tree():
    """What the world is: nodes with images, and links."""
    tree = bpy.context.scene.world.node_tree
    images = {node.name: getattr(node, "image", None) for node in tree.nodes}
    links = {(i.from_socket.path_from_id(), i.to_socket.path_from_id()) for i in tree.links}
    return images, links


def sky(rows=4):
    pixels = np.random.default_rng(4).random((rows, 2 * rows, 3)).astype(np.float32)
    made.environment(bpy.context.scene.world, pixels)
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.reset_rows()
    return pixels


def requested():
    found = request.run_request(bpy.context.scene, made.read())
    return next(item for item in found.unknowns if item.parameter == NAME)


def test_the_world_has_a_row_that_is_reset_by_the_scene(settings):
    found = row()
    assert (found.owner, found.kind, found.width) == ("World", "world", 3)
    assert (found.value, found.reason) == ("no image", "")
    assert (found.grid_from, found.environment_size) == ("new", 512)
    assert (found.minimum, found.maximum) == (0, 10000)
    assert tuple(found.start) == pytest.approx((0.5, 0.5, 0.5))
    sky()
    found = row()
    assert (found.value, found.grid_from) == ("8 x 4", "scene")
    found.environment_size, found.projection, found.grid_path = 128, "mirror_ball", "ball.png"
    bpy.ops.selenite.refresh_rows()
    found = row()
    assert (found.environment_size, found.projection) == (128, "mirror_ball")
    found.environment_size = 5000
    assert found.environment_size == 2048


def test_a_world_that_cannot_take_an_image_says_why(settings):
    bpy.context.scene.world.use_nodes = False
    bpy.ops.selenite.refresh_rows()
    assert "does not use nodes: switch on Use Nodes" in row().reason


def test_numbers_of_enums_stay_as_files_have_them():
    items = [item[::3] for item in environment_rows.PROJECTION_ITEMS]
    assert items == [("equirect", 0), ("mirror_ball", 1)]


def test_the_panel_offers_what_the_start_needs(settings):
    settings.active_row = [item.parameter for item in settings.rows].index(NAME)
    found = row()
    asked = {}
    for start in ("new", "file", "scene"):
        found.grid_from = start
        lines = draw(panels.SELENITE_PT_parameters).splitlines()
        names = ("voxels", "texels", "unseen", "grid_path", "projection", "environment_size")
        asked[start] = [name for name in names if name in lines]
    assert asked == {
        "new": ["environment_size"],
        "file": ["grid_path", "projection", "environment_size"],
        "scene": ["environment_size"],
    }


def test_the_request_is_that_of_the_command_line(settings, tmp_path):
    found = tick()
    asked = requested()
    assert (asked.size, asked.grid, asked.projection, asked.start) == (8, "", "", None)
    found.use_start, found.start = True, (0.25, 0.5, 0.75)
    assert requested().start == (0.25, 0.5, 0.75)
    found.use_start, found.grid_from, found.grid_path = False, "file", str(tmp_path / "a.png")
    found.projection = "mirror_ball"
    asked = requested()
    assert (asked.grid, asked.projection) == (str(tmp_path / "a.png"), "mirror_ball")
    pixels = sky()
    found = tick()
    assert (requested().grid, requested().start) == ("", None)
    found.grid_from = "new"
    assert requested().start == pytest.approx(pixels.mean(axis=(0, 1)), rel=0.3)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grid_from": "file"}, "choose a panorama or a mirror ball"),
        ({"grid_from": "scene"}, "scene's image, and there is none; choose New or File"),
        ({"grid_from": "file", "grid_path": "/nowhere.exr"}, "cannot be read"),
        ({"minimum": 2.0, "maximum": 1.0}, "bounds [2, 1]"),
    ],
)
def test_problems_are_reported_and_nothing_starts(settings, values, words):
    tick(**values)
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.selenite.start()
    assert words in str(caught.value)
    assert not len(settings.results)


def texels(world):
    """Of a fitted world of two rows: each stands in the middle of 101 rows and columns, as Apply
    writes finer rows for Cycles."""
    return world.image[50::101, 50::101]


def test_fit_apply_restore(settings, tmp_path):
    tick()
    before = world_tree()
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert world_tree() == before
    (folder,) = (tmp_path / "out").iterdir()
    path = folder / "World_environment.exr"
    (result,) = settings.results
    assert (result.parameter, result.grid_file) == (NAME, str(path))
    report = json.loads((folder / "result.json").read_text())["parameters"]["World:environment"]
    assert report["texels"] == [4, 2]
    assert report["files"] == ["World_environment.exr", "World_environment.png"]
    assert (folder / "World_environment.png").is_file()
    means = ", ".join(f"{value:.4f}" for value in report["value"])
    assert f" -> {means}\n" in result.text
    assert result.text.endswith("% seen by the photos")
    fitted = native.image().read(str(path))[0]
    assert fitted.shape == (2, 4, 3) and np.ptp(fitted) > 0
    for _ in range(2):
        assert bpy.ops.selenite.apply() == {"FINISHED"}
        world = made.read().world
        np.testing.assert_array_equal(texels(world), fitted)
        assert (world.color, world.strength) == ((1, 1, 1), 1)
        assert row().value == "404 x 202"
        assert bpy.ops.selenite.restore() == {"FINISHED"}
        assert world_tree() == before
        assert row().value == "no image"
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
    again = native.image().read(str(state.RUN.done.folder / path.name))[0]
    np.testing.assert_array_equal(again, fitted)


def test_a_result_is_applied_and_restored_after_saving_and_loading(settings, tmp_path):
    tick()
    before = set(world_tree()[0]), world_tree()[1]
    bpy.ops.selenite.start()
    fitted = native.image().read(settings.results[0].grid_file)[0]
    bpy.ops.wm.open_mainfile(filepath=made.save(tmp_path / "scene.blend"))
    assert row().environment_size == 8
    bpy.ops.selenite.apply()
    np.testing.assert_array_equal(texels(made.read().world), fitted)
    bpy.ops.wm.open_mainfile(filepath=made.save(tmp_path / "scene.blend"))
    np.testing.assert_array_equal(texels(made.read().world), fitted)
    bpy.ops.selenite.restore()
    assert (set(world_tree()[0]), world_tree()[1]) == before


def test_apply_is_one_undo_step(settings):
    tick()
    bpy.ops.selenite.start()
    before = world_tree()
    undo_steps.prepare()
    bpy.ops.selenite.apply("EXEC_DEFAULT", True)
    assert world_tree() != before
    undo_steps.undo()
    assert world_tree() == before
    assert not bpy.context.scene.selenite.applied


def test_apply_is_all_or_none(settings):
    tick()
    roughness = next(item for item in settings.rows if item.parameter == "roughness")
    roughness.enabled = True
    bpy.ops.selenite.start()
    before = world_tree(), made.read().owners["Body"].values["roughness"]
    bpy.context.scene.world.use_nodes = False
    with pytest.raises(RuntimeError, match="does not use nodes"):
        bpy.ops.selenite.apply()
    bpy.context.scene.world.use_nodes = True
    assert (world_tree(), made.read().owners["Body"].values["roughness"]) == before
    assert not settings.applied


def test_the_picture_is_that_of_the_newest_values(settings):
    assert environment_panel.field() is None or state.RUN.done.result is not None
    tick()
    bpy.ops.selenite.start()
    assert not environment_panel.update()  # it has ended
    image = bpy.data.images[environment_panel.IMAGE]
    assert tuple(image.size) == (256, 128) and image.users == 0
    pixels = np.array(image.pixels).reshape(128, 256, 4)[::-1]
    fitted = native.image().read(settings.results[0].grid_file)[0]
    brightest = np.unravel_index(fitted.mean(axis=-1).argmax(), (2, 4))
    shown = pixels[..., :3].mean(axis=-1).reshape(2, 64, 4, 64).mean(axis=(1, 3))
    assert shown[brightest] == pytest.approx(shown.max(), abs=1e-5)
    assert "4 x 2 directions" in draw(environment_panel.SELENITE_PT_environment)


def test_the_check_in_cycles_has_the_environment(settings):
    tick()
    bpy.ops.selenite.start()
    for apply in (False, True):
        if apply:
            assert bpy.ops.selenite.apply() == {"FINISHED"}
        assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
        assert "Selenite against Cycles" in state.CHECK.lines[0]


def test_what_cannot_take_an_image_says_so(settings):
    tick()
    settings.trade_budget = 1
    with pytest.raises(RuntimeError, match="grid or image has too many values"):
        bpy.ops.selenite.suggest_camera()
    with pytest.raises(RuntimeError, match="grid or image cannot be made"):
        bpy.ops.selenite.trade()
    assert bpy.ops.selenite.estimate() == {"FINISHED"}
