# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids in the panel: from a tick to a Volume object, and back."""

import bpy
import made_scenes as made
import numpy as np
import pytest
import undo_steps
from drawn_panels import draw

from selenite import grid_files
from selenite.interface import panels, request
from selenite.scene_read import openvdb_files

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


def row_of(parameter):
    rows = bpy.context.scene.selenite.rows
    return next(item for item in rows if item.parameter == parameter)


@pytest.fixture
def settings(addon, tmp_path):
    """A scene of smoke with a photo; nothing is ticked."""
    made.smoke()
    path = made.photo(tmp_path / "Camera.exr", value=0.3)
    settings = bpy.context.scene.selenite
    bpy.ops.selenite.refresh_rows()
    bpy.ops.selenite.add_capture()
    settings.captures[0].photo = bpy.data.images.load(str(path))
    settings.height, settings.iterations, settings.tolerance = 8, 3, 0.0
    settings.picture_spp, settings.threads = 8, 1
    settings.output = str(tmp_path / "out")
    return settings


def tick(parameter, **values):
    row = row_of(parameter)
    row.enabled = True
    for key, value in {"voxels": 3, **values}.items():
        setattr(row, key, value)
    return row


def test_a_medium_has_rows_for_its_grids_and_they_keep_what_is_set(settings, tmp_path):
    file = str(tmp_path / "a.vol")
    row = tick("density_grid", voxels=5, grid_path=file, grid_from="file", maximum=4.0)
    assert row.value == "no grid"
    bpy.ops.selenite.refresh_rows()
    row = row_of("density_grid")
    assert (row.enabled, row.voxels, row.grid_path, row.grid_from) == (
        True,
        5,
        file,
        "file",
    )
    assert row.maximum == 4
    bpy.ops.selenite.reset_rows()
    row = row_of("density_grid")
    assert (row.voxels, row.grid_from, row.maximum) == (16, "new", 10)
    assert row_of("albedo_grid").maximum == 1
    made.world()
    for node in list(bpy.data.materials["Smoke"].node_tree.nodes):
        if node.bl_idname == "ShaderNodeVolumePrincipled":
            node.inputs["Density"].default_value = 0
    bpy.ops.selenite.refresh_rows()
    assert not any(item.parameter == "density_grid" for item in settings.rows)


def test_the_panel_offers_what_the_start_needs(settings):
    names = [item.parameter for item in settings.rows]
    settings.active_row = names.index("density_grid")
    row = settings.rows[settings.active_row]
    asked = {}
    for start in ("new", "file", "scene"):
        row.grid_from = start
        lines = draw(panels.SELENITE_PT_parameters).splitlines()
        asked[start] = [name for name in ("voxels", "grid_path") if name in lines]
        assert "grid_from" in lines
    assert asked == {"new": ["voxels"], "file": ["grid_path"], "scene": []}
    settings.active_row = names.index("albedo")
    assert "grid_from" not in draw(panels.SELENITE_PT_parameters).splitlines()


def test_the_request_is_that_of_the_command_line(settings, tmp_path):
    tick("density_grid", use_start=True, start=(0.5, 0, 0))
    tick("albedo_grid", grid_from="file", grid_path=str(tmp_path / "a.npy"))
    found = request.run_request(bpy.context.scene, made.read())
    density = next(item for item in found.unknowns if item.parameter == "density_grid")
    albedo = next(item for item in found.unknowns if item.parameter == "albedo_grid")
    assert (density.grid, density.start, density.maximum) == ("3", (0.5,), 10)
    assert (albedo.grid, albedo.start) == (str(tmp_path / "a.npy"), None)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"grid_from": "file"}, "none is chosen"),
        ({"grid_from": "scene"}, "choose New or File"),
        ({"grid_from": "file", "grid_path": "/nowhere.vol"}, "cannot be read"),
        ({"minimum": 3.0, "maximum": 2.0}, r"bounds \[3, 2\]"),
    ],
)
def test_problems_are_reported_and_nothing_starts(settings, values, words):
    tick("density_grid", **values)
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.selenite.start()
    assert not len(settings.results)


def looked_up(grid, shape):
    """What a grid has, trilinearly, where a finer one of that shape has its voxel n // 2."""
    for axis, n in enumerate(shape[:3]):
        place = (n // 2 + 0.5) / n * grid.shape[axis] - 0.5
        low = int(np.floor(place))
        below, above = (np.take(grid, [i], axis) for i in (low, min(low + 1, grid.shape[axis] - 1)))
        grid = below + (place - low) * (above - below)
    return grid[0, 0, 0]


def test_fit_apply_restore(settings, tmp_path):
    if openvdb_files.module() is None:
        pytest.skip("this Blender has no OpenVDB module for Python")
    tick("density_grid")
    tick("albedo_grid")
    tick("anisotropy")
    settings.iterations = 10  # enough to explain the photo better than the start does
    assert bpy.ops.selenite.start() == {"FINISHED"}
    (folder,) = (tmp_path / "out").iterdir()
    fitted = grid_files.read(str(folder / "Smoke_density.npy"))
    assert np.ptp(fitted) > 0
    assert (folder / "Smoke_albedo.vol").is_file()
    results = {row.parameter: row for row in settings.results}
    assert "mean 1.0000 -> " in results["density_grid"].text
    before = made.read().owners["Smoke"].values
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert settings.applied
    item = bpy.data.objects["Smoke grids"]
    assert item.data.filepath == str(folder / "Smoke.vdb")
    assert bpy.data.objects["Body"].hide_render
    shown = made.read()
    assert not shown.problems
    grids = shown.materials[0].grids
    # In the middle nothing of the ball's edge is near.
    density, albedo = (grids[use].values for use in ("density", "albedo"))
    middle = tuple(n // 2 for n in density.shape[:3])
    assert density[middle] == pytest.approx(looked_up(fitted, density.shape), rel=0.02)
    wanted = looked_up(grid_files.read(str(folder / "Smoke_albedo.npy")), albedo.shape)
    middle = tuple(n // 2 for n in albedo.shape[:3])
    assert albedo[middle] == pytest.approx(wanted, rel=0.02)
    anisotropy = results["anisotropy"].value[0]
    assert shown.owners["Smoke grids"].values["anisotropy"][0] == pytest.approx(anisotropy)
    assert bpy.ops.selenite.restore() == {"FINISHED"}
    assert made.read().owners["Smoke"].values == before
    assert "Smoke grids" not in bpy.data.objects


def test_apply_is_one_undo_step(settings):
    if openvdb_files.module() is None:
        pytest.skip("this Blender has no OpenVDB module for Python")
    tick("density_grid")
    bpy.ops.selenite.start()
    undo_steps.prepare()
    bpy.ops.selenite.apply("EXEC_DEFAULT", True)
    assert "Smoke grids" in bpy.data.objects
    undo_steps.undo()
    assert "Smoke grids" not in bpy.data.objects
    assert not bpy.data.objects["Body"].hide_render
    assert made.read().owners["Smoke"].values["extinction"] == pytest.approx((2,) * 3)


def test_without_openvdb_apply_keeps_what_can_be_written(settings, monkeypatch):
    tick("density_grid")
    tick("anisotropy")
    bpy.ops.selenite.start()
    monkeypatch.setattr(openvdb_files, "module", lambda: None)
    with pytest.raises(RuntimeError, match="cannot show grids"):
        bpy.ops.selenite.check_in_cycles()
    assert bpy.ops.selenite.apply() == {"FINISHED"}
    assert "Smoke grids" not in bpy.data.objects
    value = next(row.value[0] for row in settings.results if row.parameter == "anisotropy")
    assert made.read().owners["Smoke"].values["anisotropy"][0] == pytest.approx(value)


def test_the_check_in_cycles_before_and_after_apply(settings):
    if openvdb_files.module() is None:
        pytest.skip("this Blender has no OpenVDB module for Python")
    from selenite.interface.state import CHECK

    tick("density_grid")
    tick("extinction", maximum=5.0)
    bpy.ops.selenite.start()
    for apply in (False, True):
        if apply:
            bpy.ops.selenite.apply()
        assert bpy.ops.selenite.check_in_cycles() == {"FINISHED"}
        assert "Selenite against Cycles" in CHECK.lines[0]
        assert CHECK.sheet.is_file()
