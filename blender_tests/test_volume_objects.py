# SPDX-License-Identifier: GPL-3.0-or-later
"""Volume objects with OpenVDB grids: read, rendered as Cycles does, written back."""

import bpy
import made_geometry as geometry
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.cycles_check import render as cycles
from selenite.scene_read import openvdb_files, volume_objects
from selenite.scene_read.build import build
from selenite.scene_read.shading.nodes import Unreadable

pytestmark = [pytest.mark.blender, pytest.mark.slow]

VOXEL = 0.25


@pytest.fixture(autouse=True)
def vdb():
    """The host's OpenVDB module."""
    module = openvdb_files.module()
    if module is None:
        pytest.skip("this Blender has no OpenVDB module for Python")
    return module


def ball(side=12):
    """Density of a ball, (nx, ny, nz), soft at its edge; the half of larger x is denser."""
    axis = (np.arange(side) + 0.5) / side * 2 - 1
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    inside = np.clip((1 - np.sqrt(x**2 + y**2 + z**2)) * 4, 0, 1)
    return (inside * np.where(x > 0, 2.0, 0.8)).astype(np.float32)


def colours(side=12):
    """(nx, ny, nz, 3): redder with y, never black."""
    values = np.full((side, side, side, 3), 0.3, np.float32)
    values[..., 0] = np.linspace(0.2, 0.95, side, dtype=np.float32)[None, :, None]
    return values


def write(vdb, path, **arrays):
    """Grids over the cube from -1.5 to 1.5, by name."""
    grids = []
    for name, values in arrays.items():
        grid = vdb.FloatGrid() if values.ndim == 3 else vdb.Vec3SGrid()
        grid.name = name
        grid.copyFromArray(values, ijk=(0, 0, 0))
        rows = np.diag([VOXEL, VOXEL, VOXEL, 1.0])
        rows[3, :3] = -1.5
        grid.transform = vdb.createLinearTransform(rows.tolist())
        grids.append(grid)
    vdb.write(str(path), grids)
    return str(path)


def cloud(path, density=1.5, **inputs):
    """A Volume object under a lamp and a world, and its Principled Volume."""
    data = bpy.data.volumes.new("Cloud")
    data.filepath = path
    data.render.precision = "FULL"
    item = made.add("Cloud", data)
    material = bpy.data.materials.new("Smoke")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.remove(made.principled(material))
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    node.inputs["Density"].default_value = density
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    data.materials.append(material)
    made.camera(distance=6)
    made.world(strength=0.4)
    made.light(energy=150).location = (2, 1, 4)
    return item, node


def cloud_of_nodes(joined, **inputs):
    """A Volume Cube of geometry nodes on a mesh, of the same material as `cloud`; `joined`: joined
    with the mesh, a floor."""
    host = made.triangle("Cloud", made.material("Floor"))
    host.location = (0, 0, -2)
    item, node = cloud("", **inputs)
    material = item.data.materials[0]
    bpy.data.objects.remove(item)
    tree = geometry.Tree(host)
    fog = tree.add("GeometryNodeVolumeCube")
    for name, value in {"Min": (-1, -1, 1), "Max": (1, 1, 3)}.items():
        fog.inputs[name].default_value = value
    for axis in "XYZ":
        fog.inputs[f"Resolution {axis}"].default_value = 12
    painted = tree.add("GeometryNodeSetMaterial")
    painted.inputs["Material"].default_value = material
    tree.link(fog, painted)
    if joined:
        both = tree.add("GeometryNodeJoinGeometry")
        tree.link(tree.source, both)
        tree.link(painted, both)
        painted = both
    tree.link(painted, tree.end)
    return host, node


def problems():
    return [item.line() for item in made.read().problems]


def test_grids_are_read_where_they_lie(vdb, tmp_path):
    item, _ = cloud(write(vdb, tmp_path / "a.vdb", density=ball(), albedo=colours()),
                    Color_Attribute="albedo", Color=(0.5, 1.0, 1.0, 1.0))  # fmt: skip
    item.location = (1, 2, 3)
    item.scale = (2, 2, 2)
    read = made.read()
    assert not read.problems
    material = read.materials[0]
    assert material.values["extinction"] == pytest.approx((1.5,) * 3)
    density, albedo = material.grids["density"], material.grids["albedo"]
    # 12 voxels, all of them active where the ball is not 0, and one of background on either side.
    assert density.values.shape == (14, 14, 14, 1)
    # In object space a density is per length of the object's own space.
    assert density.values[7, 7, 8, 0] == pytest.approx(ball()[7, 6, 6] / 2)
    assert density.values[0].max() == 0
    assert albedo.values[7, 3, 7, 0] == pytest.approx(0.5 * colours()[6, 2, 6, 0])
    corners = np.linalg.inv(density.to_unit) @ np.array([[0, 0, 0, 1], [1, 1, 1, 1]]).T
    reach = 2 * (1.5 + VOXEL)
    assert corners[:3, 0] == pytest.approx((1 - reach, 2 - reach, 3 - reach), abs=1e-5)
    assert corners[:3, 1] == pytest.approx((1 + reach, 2 + reach, 3 + reach), abs=1e-5)


@pytest.mark.parametrize(
    "case",
    [
        "density",
        "density and colour",
        "scaled",
        "scaled, world space",
        "nodes",
        "nodes, joined with a mesh",
    ],
)
def test_cycles_renders_the_same(vdb, tmp_path, case):
    """The mean of the picture within noise and 0.2 % for the steps of Cycles' ray marching; four
    standard deviations: 1 false alarm in 1000 runs. Half a voxel of displacement gives 2 %."""
    colour = case == "density and colour"
    path = write(vdb, tmp_path / "a.vdb", density=ball(), albedo=colours())
    color = (0.9, 0.9, 0.9, 1.0) if colour else (0.8, 0.6, 0.3, 1.0)
    if case.startswith("nodes"):
        item, node = cloud_of_nodes("joined" in case, Color=color)
    else:
        item, node = cloud(path, Color=color)
    if colour:
        node.inputs["Color Attribute"].default_value = "albedo"
    if case.startswith("scaled"):
        item.scale = (0.7, 0.7, 0.7)
        item.rotation_euler = (0.3, 0.2, 0.5)
    if case.endswith("world space"):
        item.data.render.space = "WORLD"
    scene = bpy.context.scene
    scene.cycles.volume_step_rate = 0.1
    scene.cycles.volume_max_steps = 1024
    size = (24, 18)
    film = native.core().render(build(made.read()), "Camera", *size, 600, seed=5)
    assert film.dropped == 0
    renders = np.stack(
        [cycles.render(scene, "Camera", size, 24, seed, tmp_path / "c.exr") for seed in range(5)]
    ).mean(axis=(1, 2))
    ours = film.image.mean(axis=(0, 1))
    noise = np.hypot(
        renders.std(axis=0, ddof=1) / np.sqrt(len(renders)),
        np.sqrt((film.standard_error**2).sum(axis=(0, 1))) / np.prod(size),
    )
    theirs = renders.mean(axis=0)
    print(case, "relative difference", ours / theirs - 1, "noise", noise / theirs)
    assert (np.abs(ours - theirs) < 4 * noise + 0.002 * theirs).all(), (ours, theirs, noise)
    assert (noise < 0.002 * theirs).all()


def test_what_cannot_be_rendered_is_named(vdb, tmp_path):
    path = write(vdb, tmp_path / "a.vdb", smoke=ball())
    _, node = cloud(path)
    assert any("'Cloud'" in text and "no grid 'density'" in text for text in problems())
    node.inputs["Density Attribute"].default_value = "smoke"
    assert not problems()
    node.inputs["Color Attribute"].default_value = "heat"
    assert any("no grid 'heat'" in text for text in made.read().warnings)
    node.inputs["Color Attribute"].default_value = "smoke"
    assert problems()
    bpy.data.volumes["Cloud"].filepath = str(tmp_path / "missing.vdb")
    assert any("does not load" in text for text in problems())


def test_grids_of_modifiers_are_read_and_not_written(tmp_path):
    """A Volume Cube of 12 voxels a side with density 1 everywhere, padded by one of background."""
    made.camera()
    host, _ = cloud_of_nodes(joined=True)
    values = made.read()
    assert not values.problems
    assert sorted(item.name for item in values.objects) == ["Cloud", "Cloud"]
    density = next(item for item in values.materials if item.grids).grids["density"]
    assert density.values.shape == (14, 14, 14, 1)
    assert density.values[1:-1, 1:-1, 1:-1] == pytest.approx(np.ones((12, 12, 12, 1)))
    second = host.copy()
    second.location.x = 9  # its mesh would be there twice
    bpy.context.scene.collection.objects.link(second)
    assert not made.read().problems
    bpy.context.scene.render.use_simplify = True
    bpy.context.scene.render.simplify_volumes = 0.5
    assert any("Simplify renders volumes at 0.5" in text for text in problems())
    bpy.data.objects.remove(second)
    item = made.add("Made", bpy.data.volumes.new("Made"))
    item.data.materials.append(bpy.data.materials["Smoke"])
    item.modifiers.new("Fog", "MESH_TO_VOLUME").object = geometry.cube("Source")
    with pytest.raises(Unreadable, match="modifiers"):
        volume_objects.write(item, bpy.data.materials["Smoke"], {}, str(tmp_path / "x.vdb"))


def test_a_fitted_grid_is_written_and_read_again(vdb, tmp_path):
    item, node = cloud(write(vdb, tmp_path / "a.vdb", density=ball(), albedo=colours()),
                       Color_Attribute="albedo")  # fmt: skip
    item.location = (0.5, 0, -1)
    item.rotation_euler = (0.4, 0.0, 0.2)
    bpy.context.view_layer.update()
    node.inputs["Color"].default_value = (0.7, 0.7, 0.7, 1)
    grids = made.read().materials[0].grids
    fitted = grids["albedo"]
    fitted.values[:] = np.random.default_rng(3).random(fitted.values.shape, np.float32)
    out = tmp_path / "b.vdb"
    volume_objects.write(item, bpy.data.materials["Smoke"], {"albedo": fitted}, str(out))
    again = made.read()
    assert not again.problems
    found = again.materials[0].grids
    assert np.array_equal(found["density"].values, grids["density"].values)
    # One voxel more on each side, and around that the background.
    assert np.allclose(found["albedo"].values[2:-2, 2:-2, 2:-2], fitted.values, atol=1e-6)
    edge = np.linalg.inv(fitted.to_unit) @ [0.5, 0.5, 0.5, 1]
    assert np.allclose(found["albedo"].to_unit @ edge, [0.5, 0.5, 0.5, 1], atol=1e-5)


@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_fitted_densities_are_written_and_read_again_and_put_back(vdb, tmp_path, space):
    item, node = cloud(write(vdb, tmp_path / "a.vdb", density=ball(), albedo=colours()),
                       Color_Attribute="albedo")  # fmt: skip
    item.data.render.space = space
    item.location = (0.5, 0, -1)
    item.scale = (2, 2, 2)
    item.rotation_euler = (0.4, 0.0, 0.2)
    bpy.context.view_layer.update()
    grids = made.read().materials[0].grids
    fitted = grids["density"]
    kept = fitted.values.copy()
    fitted.values[:] = np.random.default_rng(3).random(fitted.values.shape, np.float32) + 0.1
    material = bpy.data.materials["Smoke"]
    before = volume_objects.write(item, material, {"density": fitted}, str(tmp_path / "b.vdb"))
    found = made.read().materials[0].grids
    assert np.allclose(found["density"].values[1:-1, 1:-1, 1:-1], fitted.values, atol=1e-5)
    assert np.array_equal(found["albedo"].values, grids["albedo"].values)
    assert node.inputs["Color Attribute"].default_value == "albedo"
    volume_objects.put_back(item, material, before)
    assert np.array_equal(made.read().materials[0].grids["density"].values, kept)


def test_fitted_densities_of_an_object_pass_the_check_in_cycles(vdb, tmp_path, capsys):
    item, _ = cloud(write(vdb, tmp_path / "a.vdb", density=ball()), Color=(0.8, 0.8, 0.8, 1))
    item.rotation_euler = (0.3, 0.0, 0.5)
    path = made.save(tmp_path / "scene.blend")
    picture = made.photo(tmp_path / "photo.exr", value=0.3)
    status, report, text = command(
        capsys, "fit", path, "--fit", "Smoke:density_grid", "--photo", f"Camera={picture}",
        "--height", "12", "--iterations", "3", "--threads", "1", "--out", str(tmp_path), "--save",
        str(tmp_path / "out.blend"), "--check-in-cycles",
    )  # fmt: skip
    assert status == 0, text
    assert report["parameters"]["Smoke:density_grid"]["voxels"] == [14, 14, 14]
    row = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(row["relative_bias_beyond_noise"]) < 0.01, row
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert bpy.data.volumes["Cloud"].filepath.endswith("Smoke.vdb")
    assert not made.read().problems


def test_a_fit_gives_the_object_its_new_file(vdb, tmp_path, capsys):
    cloud(write(vdb, tmp_path / "a.vdb", density=ball()))
    path = made.save(tmp_path / "scene.blend")
    picture = made.photo(tmp_path / "photo.exr", value=0.3)
    status, _, text = command(
        capsys, "fit", path, "--fit", "Smoke:albedo_grid", "--grid", "Smoke:albedo_grid=3",
        "--photo", f"Camera={picture}", "--height", "8", "--iterations", "3", "--threads", "1",
        "--out", str(tmp_path), "--save", str(tmp_path / "out.blend"),
    )  # fmt: skip
    assert status == 0, text
    assert "now renders" in text
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    data = bpy.data.volumes["Cloud"]
    assert data.filepath.endswith("Smoke.vdb")
    read = made.read()
    assert not read.problems
    grid = read.materials[0].grids["albedo"]
    assert grid.values.shape == (7, 7, 7, 3)
    assert np.ptp(grid.values[2:-2, 2:-2, 2:-2]) > 0
    assert "albedo_grid" in read.owners["Smoke"].fixed["albedo"]
