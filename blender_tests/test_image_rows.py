# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of base colours in the panel: from a tick to an Image Texture node, and back."""

import json
from pathlib import Path

import bpy
import made_images
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from drawn_panels import draw

from selenite import native
from selenite.interface import panels, request, state
from selenite.interface.rows import properties as row_properties
from selenite.scene_read import openvdb_files

pytestmark = [pytest.mark.blender, pytest.mark.blender34]

NAME = "base_color_texture"


def give_image(material, folder, **options):
    """An Image Texture of 5 x 3 texels for the base colour."""
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = made_images.image(folder, "file8", **{"alpha": False, **options})
    made.link(material, node.outputs["Color"])
    return node


def rows(name=NAME):
    return {row.owner: row for row in bpy.context.scene.selenite.rows if row.parameter == name}


def tick(parameter=NAME, owner="Body", **values):
    row = rows(parameter)[owner]
    row.enabled = True
    for key, value in {"texels": 4, **values}.items():
        setattr(row, key, value)
    return row


def photographed(tmp_path):
    """The panel of the open scene, with a photo; nothing is ticked."""
    path = made.photo(tmp_path / "Camera.exr", value=0.15)
    settings = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(path))
    settings.height, settings.iterations, settings.tolerance = 16, 4, 0.0
    settings.picture_spp, settings.threads = 8, 1
    settings.output = str(tmp_path / "out")
    return settings


@pytest.fixture
def settings(addon, tmp_path):
    """A scene of a ball of one colour, with a photo."""
    made.studio(base_color=(0.5, 0.4, 0.3), roughness=0.5)
    return photographed(tmp_path)


def tree(material="Body"):
    """Nodes with their images, links, and values of the Principled node."""
    material = bpy.data.materials[material]
    found = material.node_tree
    images = {node.name: getattr(node, "image", None) for node in found.nodes}
    ends = {(i.from_socket.path_from_id(), i.to_socket.path_from_id()) for i in found.links}
    inputs = made.principled(material).inputs
    values = [getattr(item, "default_value", None) for item in inputs]
    values = [tuple(item) if hasattr(item, "__len__") else item for item in values]
    return images, ends, values, sorted(material.keys())


def texels(path):
    return native.image().read(str(path), as_linear=False)[0]


def shown(owner="Body"):
    """The texels that the scene has."""
    values = made.read()
    assert not values.problems, values.problems
    return next(m for m in values.materials if m.name == owner).maps["base_color"].texture.pixels


def requested():
    """The image of the panel's request."""
    found = request.run_request(bpy.context.scene, made.read())
    return next(item for item in found.unknowns if item.parameter == NAME)


@pytest.mark.usefixtures("addon")
def test_rows_for_colours_and_images_but_not_for_attributes(tmp_path):
    made.smoke()  # a medium alone
    names = ("Colour", "Image", "Attribute", "Plain", "Muted", "Bare", "Scattering", "Clear")
    kinds = {name: made.material(name) for name in names}
    for material in kinds.values():
        made.triangle(material.name, material)
    give_image(kinds["Image"], tmp_path)
    node = kinds["Attribute"].node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Paint"
    made.link(kinds["Attribute"], node.outputs["Color"])
    kinds["Plain"].use_nodes = False
    give_image(kinds["Muted"], tmp_path).mute = True
    mesh = bpy.data.objects["Bare"].data
    mesh.uv_layers.remove(mesh.uv_layers[0])
    inputs = made.principled(kinds["Scattering"]).inputs
    if "Subsurface Weight" in inputs:  # that of Blender 3 is not modelled
        inputs["Subsurface Weight"].default_value = 1
    clear = give_image(kinds["Clear"], tmp_path, alpha=True, mode="STRAIGHT")
    kinds["Clear"].node_tree.links.new(clear.outputs["Alpha"], made.socket(kinds["Clear"], "alpha"))
    bpy.ops.selenite.refresh_rows()
    found = rows()
    assert {name: row.value for name, row in found.items()} == {
        "Colour": "no image",
        "Image": "5 x 3",
        "Muted": "no image",  # its own colour, as in Cycles
        "Bare": "no image",
        "Scattering": "no image",
        "Clear": "5 x 3",
    }
    assert not found["Colour"].reason and not found["Image"].reason
    assert "'Bare' has no UV map: unwrap the mesh" in found["Bare"].reason
    assert not found["Scattering"].reason
    assert "has alpha" in found["Clear"].reason
    assert set(rows("albedo_grid")) == {"Smoke"}


def test_rows_keep_what_is_set_and_are_reset(settings, tmp_path):
    file = str(tmp_path / "a.png")
    changed = {"texels": 7, "grid_path": file, "grid_from": "file", "unseen": "keep"}
    row = tick(**changed, use_start=True, start=(0.25, 0.5, 0.75), maximum=0.5)
    bpy.ops.selenite.refresh_rows()
    row = rows()["Body"]
    assert row.enabled and row.use_start
    assert {name: getattr(row, name) for name in changed} == changed
    assert (tuple(row.start), row.maximum) == ((0.25, 0.5, 0.75), 0.5)
    bpy.ops.selenite.reset_rows()
    assert (row.texels, row.grid_from, row.unseen, row.use_start) == (256, "new", "auto", False)
    assert (row.minimum, row.maximum) == (0, 1)
    assert tuple(row.start) == pytest.approx((0.5, 0.4, 0.3))
    row.texels = 10**6
    assert row.texels == 8192
    give_image(bpy.data.materials["Body"], tmp_path)
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.reset_rows()
    row = rows()["Body"]
    assert (row.value, row.grid_from) == ("5 x 3", "scene")
    assert tuple(row.start) == pytest.approx((0.8,) * 3)
    mesh = bpy.data.objects["Body"].data
    mesh.uv_layers.remove(mesh.uv_layers[0])
    mesh.update()
    bpy.ops.selenite.refresh_rows()
    row = rows()["Body"]
    assert row.reason and not row.enabled


def test_numbers_of_enums_stay_as_files_have_them():
    starts, unseen = row_properties.GRID_ITEMS, row_properties.UNSEEN_ITEMS
    assert [item[0] for item in starts] == ["new", "scene", "file"]
    assert [item[0] for item in unseen] == ["auto", "keep", "fill"]
    assert [item[3] for item in (*starts, *unseen)] == [0, 1, 2, 0, 1, 2]


def test_the_panel_offers_what_the_start_needs(settings):
    settings.active_row = [item.parameter for item in settings.rows].index(NAME)
    row = settings.rows[settings.active_row]
    asked = {}
    for start in ("new", "file", "scene"):
        row.grid_from = start
        lines = draw(panels.SELENITE_PT_parameters).splitlines()
        asked[start] = [name for name in ("voxels", "texels", "grid_path") if name in lines]
        assert "grid_from" in lines and "unseen" in lines
    assert asked == {"new": ["texels"], "file": ["grid_path"], "scene": []}


@pytest.mark.parametrize("unseen", ["auto", "keep", "fill"])
def test_the_request_is_that_of_the_command_line(settings, tmp_path, unseen):
    row = tick(unseen=unseen)
    found = requested()
    assert (found.owner, found.grid, found.start) == ("Body", "4", None)
    assert (found.minimum, found.maximum) == (0, 1)
    assert found.unseen == ("" if unseen == "auto" else unseen)
    row.use_start, row.start = True, (0.25, 0.5, 0.75)
    assert requested().start == (0.25, 0.5, 0.75)
    row.use_start, row.grid_from, row.grid_path = False, "file", str(tmp_path / "a.png")
    assert (requested().grid, requested().start) == (str(tmp_path / "a.png"), None)
    give_image(bpy.data.materials["Body"], tmp_path)
    row.grid_from = "scene"
    assert requested().grid == ""


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grid_from": "file"}, "choose a picture"),
        ({"grid_from": "scene"}, "scene's image, and there is none; choose New or File"),
        ({"grid_from": "file", "grid_path": "/nowhere.png"}, "cannot be read"),
        ({"minimum": 0.5, "maximum": 2.0}, r"bounds \[0.5, 2\]"),
    ],
)
def test_problems_are_reported_and_nothing_starts(settings, values, words):
    tick(**values)
    with pytest.raises(RuntimeError) as caught:
        bpy.ops.selenite.start()
    assert words.replace("\\", "") in str(caught.value)
    assert not len(settings.results)


def test_fit_apply_restore_of_a_new_image(settings, tmp_path):
    tick()
    tick("roughness")
    before = tree()
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert tree() == before
    (folder,) = (tmp_path / "out").iterdir()
    path = folder / "Body_base_color.png"
    results = {row.parameter: row for row in settings.results}
    assert results[NAME].grid_file == str(path)
    report = json.loads((folder / "result.json").read_text())["parameters"][f"Body:{NAME}"]
    # From one side half of a ball is seen, and of a few large texels more.
    assert 0.3 < report["seen"] < 1
    text = draw(panels.SELENITE_PT_result)
    assert f"{100 * report['seen']:.0f} % seen by the photos" in text
    means = ", ".join(f"{value:.4f}" for value in report["value"])
    assert results[NAME].text.splitlines()[0].endswith(f" -> {means}")
    fitted = texels(path)
    assert fitted.shape == (4, 4, 3) and np.ptp(fitted) > 0
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert settings.applied
    node = made.socket(bpy.data.materials["Body"], "base_color").links[0].from_node
    assert node.image.filepath == str(path)
    np.testing.assert_allclose(shown(), fitted, atol=1 / 65535)
    assert rows()["Body"].value == "4 x 4"
    value = results["roughness"].value[0]
    assert made.read().owners["Body"].values["roughness"] == pytest.approx((value,))
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert tree() == before
    assert rows()["Body"].value == "no image"
    # Files, texts and the kept result agree: the pictures of a saved folder show the same.
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
    np.testing.assert_array_equal(texels(state.RUN.done.folder / path.name), fitted)
    assert state.RUN.done.folder != folder
    assert (state.RUN.done.folder / "Camera_optimised.png").is_file()


def test_fit_apply_restore_of_the_scenes_image(settings, tmp_path):
    node = give_image(bpy.data.materials["Body"], tmp_path)
    own = shown()
    before = tree()
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.reset_rows()
    tick()
    bpy.ops.selenite.start()
    path = settings.results[0].grid_file
    fitted = texels(path)
    assert fitted.shape == own.shape
    assert np.abs(fitted - own).max() > 0.01
    bpy.ops.selenite.apply()
    assert node.image.filepath == path
    np.testing.assert_allclose(shown(), fitted, atol=1 / 65535)
    bpy.ops.selenite.restore()
    assert tree() == before
    np.testing.assert_array_equal(shown(), own)


def test_a_result_is_applied_and_restored_after_saving_and_loading(settings, tmp_path):
    tick(unseen="keep")
    before = tree()
    bpy.ops.selenite.start()
    path = settings.results[0].grid_file
    bpy.ops.wm.open_mainfile(filepath=made.save(tmp_path / "scene.blend"))
    assert rows()["Body"].unseen == "keep"
    bpy.ops.selenite.apply()
    np.testing.assert_allclose(shown(), texels(path), atol=1 / 65535)
    bpy.ops.wm.open_mainfile(filepath=made.save(tmp_path / "scene.blend"))
    bpy.ops.selenite.restore()
    assert tree() == before


def test_apply_is_all_or_none(settings, tmp_path):
    made.hidden_ball()
    bpy.ops.selenite.refresh_rows()
    tick()
    tick(owner="Hidden")
    tick("roughness")
    bpy.ops.selenite.start()
    files = {row.owner: Path(row.grid_file) for row in settings.results if row.grid_file}
    assert list(files) == ["Body", "Hidden"]
    # What no photo sees has no mean to be filled from: it is as it was.
    texts = {row.owner: row.text for row in settings.results if row.grid_file}
    assert "0 % seen" in texts["Hidden"]
    hidden = files["Hidden"].read_bytes()
    files["Hidden"].unlink()
    before = tree("Body"), tree("Hidden")
    with pytest.raises(RuntimeError, match="does not exist"):
        bpy.ops.selenite.apply()
    assert (tree("Body"), tree("Hidden")) == before
    assert not settings.applied
    assert files["Body"].name not in bpy.data.images
    files["Hidden"].write_bytes(hidden)
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert shown("Hidden").shape == (4, 4, 3)
    bpy.ops.selenite.restore()
    assert (tree("Body"), tree("Hidden")) == before


@pytest.fixture
def both(settings):
    """The ball filled with a medium, fitted with an image on it and a grid in it; the settings."""
    material = bpy.data.materials["Body"]
    made.socket(material, "transmission").default_value = 0.5
    nodes = material.node_tree
    node = nodes.nodes.new("ShaderNodeVolumePrincipled")
    nodes.links.new(node.outputs[0], nodes.get_output_node("CYCLES").inputs["Volume"])
    bpy.ops.selenite.refresh_rows()
    tick()
    tick("density_grid", voxels=2)
    assert bpy.ops.selenite.start() == {"FINISHED"}
    assert [row.parameter for row in settings.results] == ["density_grid", NAME]
    return settings


def test_grids_and_images_are_applied_together_or_not_at_all(both):
    if openvdb_files.module() is None:
        pytest.skip("this Blender has no OpenVDB module for Python")
    before = tree()
    path = Path(both.results[1].grid_file)
    kept = path.read_bytes()
    path.unlink()
    with pytest.raises(RuntimeError, match="does not exist"):
        bpy.ops.selenite.apply()
    assert tree() == before
    assert "Body grids" not in bpy.data.objects
    path.write_bytes(kept)
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert "Body grids" in bpy.data.objects
    np.testing.assert_allclose(shown(), texels(path), atol=1 / 65535)
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert tree() == before
    assert "Body grids" not in bpy.data.objects


def test_without_openvdb_images_are_applied(both, monkeypatch):
    monkeypatch.setattr(openvdb_files, "module", lambda: None)
    before = tree()
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert "Body grids" not in bpy.data.objects
    np.testing.assert_allclose(shown(), texels(both.results[1].grid_file), atol=1 / 65535)
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert tree() == before


def test_apply_is_one_undo_step(settings):
    tick()
    before = tree()
    bpy.ops.selenite.start()
    undo_steps.prepare()
    bpy.ops.selenite.apply("EXEC_DEFAULT", True)
    assert tree() != before
    undo_steps.undo()
    assert tree() == before
    assert not bpy.context.scene.selenite.applied


def test_an_image_that_follows_its_colour(settings):
    """Both are results: the colour is written, then the image takes its place, and back."""
    tick()
    tick("base_color")
    settings.stage_mode = "colours-first"
    before = tree()
    bpy.ops.selenite.start()
    assert {row.parameter for row in settings.results} == {"base_color", NAME}
    for apply in (False, True):
        if apply:
            assert bpy.ops.selenite.apply() == {"FINISHED"}
        assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
        assert "Selenite against Cycles" in state.CHECK.lines[0]
        assert state.CHECK.sheet.is_file()
    colour = next(row.value for row in settings.results if row.parameter == "base_color")
    socket = made.socket(bpy.data.materials["Body"], "base_color")
    assert tuple(socket.default_value)[:3] == pytest.approx(tuple(colour))
    assert socket.is_linked
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert tree() == before


def test_what_cannot_take_an_image_says_so(settings):
    tick(texels=2)
    settings.trade_budget = 1
    with pytest.raises(RuntimeError, match="grid or image has too many values"):
        bpy.ops.selenite.suggest_camera()
    with pytest.raises(RuntimeError, match="grid or image cannot be made"):
        bpy.ops.selenite.trade()
    assert bpy.ops.selenite.estimate() == {"FINISHED"}
    assert draw(panels.SELENITE_PT_fit)
