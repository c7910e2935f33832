# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted grids reach Cycles as Volume objects."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.cycles_check import render as cycles
from selenite.fit import fields
from selenite.problems import BadInput
from selenite.scene_read import openvdb_files
from selenite.scene_read.build import build
from selenite.scene_read.values import GridValues
from selenite.write_back import grids as grid_objects
from selenite.write_back import voxels

pytestmark = [pytest.mark.blender, pytest.mark.blender34]


@pytest.fixture
def vdb():
    """Skips where nothing can be written."""
    if openvdb_files.module() is None:
        pytest.skip("this Blender has no OpenVDB module for Python")


def over_box(values, low, high):
    """A grid over a box in the world."""
    low, high = np.array(low, float), np.array(high, float)
    to_unit = np.eye(4)
    to_unit[:3, :3], to_unit[:3, 3] = np.diag(1 / (high - low)), -low / (high - low)
    return GridValues("grid", np.asarray(values, np.float32), to_unit)


def halves(upper, lower, channels=1):
    """4 x 4 x 4 voxels, another value for the larger y."""
    values = np.full((4, 4, 4, channels), lower, np.float32)
    values[:, 2:] = upper
    return values


def test_voxels_are_filled_as_the_meshes_are():
    smoke = made.smoke(segments=48)
    bpy.context.object.location = (0.3, -0.2, 1)
    bpy.context.object.scale = (1, -0.8, 0.5)  # mirrored
    bpy.ops.mesh.primitive_cube_add(size=1, location=(2, 0, 1))
    bpy.context.object.data.materials.append(smoke)
    values = made.read()
    low, high = np.array([-0.8, -1.1, 0.4]), np.array([2.6, 0.7, 1.6])
    sizes = np.array([68, 36, 24])
    found = voxels.filled(values, "Smoke", low, high, sizes)
    cell = np.prod((high - low) / sizes)
    # A ball of 48 x 24 faces has 0.98 of the volume of the true one.
    assert found[:, :, :40].sum() * cell == pytest.approx(4.19 * 0.8 * 0.5, rel=0.025)
    assert found[:, :, 44:].sum() * cell == pytest.approx(1, rel=1e-3)
    assert found.max() == pytest.approx(1)
    assert found[12, 18, 22] == pytest.approx(1)
    assert found[0, 0, 0] == 0


def test_a_grid_is_sampled_as_the_renderer_does():
    grid = over_box(np.arange(8).reshape(2, 2, 2, 1), (-1, -1, 0), (1, 1, 4))
    found = voxels.sampled(grid, np.array([-1, -1, 0]), np.array([1, 1, 4]), np.array([4, 4, 8]))
    assert found.shape == (8, 4, 4, 1)
    assert found[0, 0, 0, 0] == 0  # beyond the first centre
    assert found[0, 0, 1, 0] == pytest.approx(0.25)
    assert found[3, 3, 3, 0] == pytest.approx(0.375 * 4 + 3)


@pytest.mark.parametrize("case", ["density, coloured", "density and albedo", "albedo, in glass"])
def test_cycles_renders_what_was_fitted(vdb, tmp_path, case):
    """The mean of the picture within noise and 1 % for the voxels' edges; four standard deviations:
    1 false alarm in 1000 runs. A grid half a voxel away gives more than 3 %."""
    material = made.smoke(density=1.5, colour=0.7, segments=32)
    if case.endswith("coloured"):
        node = material.node_tree.get_output_node("CYCLES").inputs["Volume"].links[0].from_node
        node.inputs["Color"].default_value = (0.8, 0.5, 0.2, 1)
        node.inputs["Absorption Color"].default_value = (0.6, 0.2, 0.1, 1)
    glass = case.endswith("glass")
    if glass:
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeBsdfPrincipled")
        inputs = node.inputs
        inputs["Roughness"].default_value = 0.4
        inputs["Transmission Weight" if "Transmission Weight" in inputs else "Transmission"
               ].default_value = 1  # fmt: skip
        tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    box = (-1, -1, -1), (1, 1, 1)
    wanted = {}
    if "density" in case:
        wanted["density"] = over_box(halves(1.5, 0.2), *box)
    if "albedo" in case:
        wanted["albedo"] = over_box(halves((0.9, 0.5, 0.2), (0.2, 0.3, 0.8), 3), *box)
    read = made.read()
    size = (24, 18)
    film = native.core().render(
        build(fields.with_grids(read, {"Smoke": wanted})), "Camera", *size, 600, seed=5
    )
    scene = bpy.context.scene
    text = grid_objects.show(scene, read, "Smoke", wanted, tmp_path)
    assert "'Smoke grids' shows" in text
    assert bpy.data.objects["Body"].hide_render != glass
    assert not made.read().problems
    scene.cycles.volume_step_rate = 1
    scene.cycles.volume_max_steps = 1024
    renders = np.stack(
        [cycles.render(scene, "Camera", size, 24, seed, tmp_path / "c.exr") for seed in range(5)]
    )
    renders = renders[:, :9].mean(axis=(1, 2)), renders[:, 9:].mean(axis=(1, 2))
    for half, (ours, sem) in zip(
        renders,
        ((film.image[:9], film.standard_error[:9]), (film.image[9:], film.standard_error[9:])),
        strict=True,
    ):
        theirs = half.mean(axis=0)
        noise = np.hypot(
            half.std(axis=0, ddof=1) / np.sqrt(len(half)),
            np.sqrt((sem**2).sum(axis=(0, 1))) / sem[..., 0].size,
        )
        mean = ours.mean(axis=(0, 1))
        print(case, "relative difference", mean / theirs - 1, "noise", noise / theirs)
        assert (np.abs(mean - theirs) < 4 * noise + 0.01 * theirs).all(), (mean, theirs, noise)
        assert (noise < 0.01 * theirs).all()


def test_restore_puts_the_medium_back(vdb, tmp_path):
    made.smoke()
    scene = bpy.context.scene
    before = made.read()
    wanted = {"density": over_box(halves(1, 2), (-1, -1, -1), (1, 1, 1))}
    blocks = [len(kind) for kind in (bpy.data.objects, bpy.data.volumes, bpy.data.materials)]
    grid_objects.show(scene, before, "Smoke", wanted, tmp_path)
    assert bpy.data.objects["Body"].hide_render
    shown = made.read()
    assert shown.owners["Smoke grids"].values["extinction"] == pytest.approx((2,) * 3)
    grid_objects.restore(scene, "Smoke")
    assert not bpy.data.objects["Body"].hide_render
    after = made.read()
    assert after.owners["Smoke"].values == before.owners["Smoke"].values
    assert blocks == [
        len(kind) for kind in (bpy.data.objects, bpy.data.volumes, bpy.data.materials)
    ]


def test_what_cannot_be_shown_is_refused_and_nothing_changes(vdb, tmp_path):
    material = made.smoke()
    node = next(n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeVolumePrincipled")
    node.inputs["Absorption Color"].default_value = (0.9, 0.1, 0.1, 1)
    wanted = {"albedo": over_box(halves(0.2, 0.4, 3), (-1, -1, -1), (1, 1, 1))}
    with pytest.raises(BadInput) as caught:
        grid_objects.show(bpy.context.scene, made.read(), "Smoke", wanted, tmp_path)
    text = str(caught.value)
    assert "'Smoke'" in text and "extinction is 1" in text and "same extinction" in text
    assert "Smoke grids" not in bpy.data.objects
    assert not bpy.data.objects["Body"].hide_render


def test_the_check_in_cycles_renders_fitted_grids(vdb, tmp_path, capsys):
    made.smoke()
    path = made.save(tmp_path / "scene.blend")
    picture = made.photo(tmp_path / "photo.exr", value=0.3)
    status, report, text = command(
        capsys, "fit", path, "--fit", "Smoke:density_grid", "--grid", "Smoke:density_grid=3",
        "--photo", f"Camera={picture}", "--height", "12", "--iterations", "3", "--threads", "1",
        "--out", str(tmp_path / "out"), "--check-in-cycles", "--save", str(tmp_path / "new.blend"),
    )  # fmt: skip
    assert status == 0, text
    assert "'Smoke grids' shows" in report["shown"][0]
    assert "'Smoke grids' shows" in report["cycles"]["shown"][0]
    row = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(row["relative_bias_beyond_noise"]) < 0.02, row
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "new.blend"))
    assert bpy.data.volumes["Smoke grids"].filepath.endswith("Smoke.vdb")
    assert not made.read().problems


def test_without_openvdb_the_rest_of_the_fit_is_kept(tmp_path, capsys, monkeypatch):
    made.smoke()
    path = made.save(tmp_path / "scene.blend")
    picture = made.photo(tmp_path / "photo.exr", value=0.3)
    monkeypatch.setattr(openvdb_files, "module", lambda: None)
    status, report, text = command(
        capsys, "fit", path, "--fit", "Smoke:density_grid", "--grid", "Smoke:density_grid=2",
        "--photo", f"Camera={picture}", "--height", "8", "--iterations", "1", "--threads", "1",
        "--out", str(tmp_path / "out"), "--check-in-cycles", "--save", str(tmp_path / "new.blend"),
    )  # fmt: skip
    assert status == 0, text
    assert "Smoke:density_grid: the check in Cycles is left out" in text
    assert "no OpenVDB module" in report["shown"][0]
    assert "cycles" not in report
    assert (tmp_path / "out" / report["folder"] / "Smoke_density.vol").is_file()
