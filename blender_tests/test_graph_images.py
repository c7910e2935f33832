# SPDX-License-Identifier: GPL-3.0-or-later
"""Images of a node graph as unknowns: the factor of a mixture and a normal map."""

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.fit import fields
from selenite.fit.request import UnknownRequest
from selenite.fit.settings import FitSettings
from selenite.scene_read.blend_file import open_blend
from selenite.scene_read.build import build

pytestmark = pytest.mark.blender

SIZE = 16


def even(path, side, color):
    """Writes an image of one colour."""
    native.image().write_exr(path, np.full((side, side, 3), color, np.float32))
    return path


def board(tmp_path):
    """A board before a lamp, with a tree to be linked, and an Image Texture 'Map' of 2 x 2
    texels."""
    filled = made.material(base_color=(0.2, 0.4, 0.7), roughness=0.4)
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    layer = mesh.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0])
    mesh.materials.append(filled)
    made.add("Board", mesh)
    made.world(strength=1.0, color=(0.3, 0.3, 0.3))
    lamp = made.light(kind="SUN", energy=2.0)
    lamp.rotation_euler = (0.4, 0.6, 0.0)
    camera = made.camera(distance=2.0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = SIZE
    tree = filled.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.name = "Map"
    path = str(tmp_path / "map.exr")
    node.image = bpy.data.images.load(even(path, 2, (0.65, 0.4, 0.85)))
    node.image.colorspace_settings.name = "Non-Color"
    return tree, node


def mixed(tmp_path):
    """The board's share of a red Diffuse BSDF comes from the image."""
    tree, node = board(tmp_path)
    principled = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    red, mix = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeMixShader")
    red.inputs["Color"].default_value = (0.9, 0.1, 0.1, 1)
    tree.links.new(node.outputs["Color"], mix.inputs[0])
    tree.links.new(principled.outputs[0], mix.inputs[1])
    tree.links.new(red.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def bumpy(tmp_path):
    """The board's normals come from the image."""
    tree, node = board(tmp_path)
    principled = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    turn = tree.nodes.new("ShaderNodeNormalMap")
    tree.links.new(node.outputs["Color"], turn.inputs["Color"])
    tree.links.new(turn.outputs["Normal"], principled.inputs["Normal"])


def field():
    problems = []
    request = [UnknownRequest("Body", "Map.image")]
    found = fields.choose(made.read(), request, [], FitSettings(), problems)
    assert not problems, [item.line() for item in problems]
    return found[0]


@pytest.mark.parametrize(
    ("make", "shape", "number"),
    [(mixed, (2, 2, 1), 0), (bumpy, (2, 2, 3), 0), (bumpy, (2, 2, 3), 2)],
    ids=["factor", "normal x", "normal z"],
)
def test_derivatives_agree_with_differences(make, shape, number, tmp_path):
    make(tmp_path)
    start = field().values
    assert start.shape == shape
    scene = build(made.read())
    core = native.core()

    def mean(step, seed):
        values = start.copy()
        values[1, 0, number] += step
        changed = scene.with_image("Body", values, "Map.image")
        return core.render(changed, "Camera", SIZE, SIZE, 64, seed=seed).image.mean()

    photo = core.Photo("Camera", size=(SIZE, SIZE))
    gaps, sizes = [], []
    for seed in range(12):
        _, found = core.Evaluator(scene).gradient(photo, "Body", "Map.image", 64, seed=seed)
        assert found.shape == shape
        slope = (mean(0.01, seed) - mean(-0.01, seed)) / 0.02
        # the mean of a picture is over three channels
        gaps.append(found[1, 0, number] / 3 - slope)
        sizes.append(abs(slope))
    # Student's t of 11 degrees of freedom beyond 4.4: 1 false alarm in 1000. 2 % for the curvature.
    error = np.std(gaps, ddof=1) / np.sqrt(len(gaps))
    assert abs(np.mean(gaps)) < 4.4 * error + 0.02 * np.mean(sizes)
    assert error < 0.25 * np.mean(sizes)


def test_a_fit_finds_the_factor_and_the_saved_scene_shows_it(tmp_path, capsys):
    mixed(tmp_path)
    path = made.save(tmp_path / "scene.blend")
    wanted = np.array([[0.1, 0.8], [0.6, 0.3]], np.float32)[..., None]
    shown = build(fields.with_fields(made.read(), [field().starting_at(wanted)]))
    film = native.core().render(shown, "Camera", SIZE, SIZE, 1024, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    status, report, _ = command(
        capsys, "fit", path, "--fit", "Body:Map.image",
        "--photo", f"Camera={tmp_path / 'photo.exr'}", "--height", str(SIZE), "--threads", "1",
        "--out", str(tmp_path / "out"), "--iterations", "120", "--spp", "8",
        "--save", str(tmp_path / "fitted.blend"), "--check-in-cycles",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"]["Body:Map.image"]
    assert row["files"] == ["Body_Map.png", "Body_Map_coverage.png"]
    found, _, _ = native.image().read(f"{report['folder']}/{row['files'][0]}", as_linear=False)
    assert np.abs(found[..., :1] - wanted).max() < 0.05
    ours = report["cycles"]["photos"]["Camera"]["native_against_cycles"]
    assert abs(ours["relative_bias"]) < 6 * ours["relative_bias_noise"] + 0.005
    open_blend(str(tmp_path / "fitted.blend"))
    assert np.abs(field().values - found[..., :1]).max() < 1e-4


def angles(found, wanted):
    """Between the normals that colours encode, in degrees."""
    ours, theirs = (2 * one.astype(float) - 1 for one in (found, wanted))
    lengths = np.linalg.norm(ours, axis=-1) * np.linalg.norm(theirs, axis=-1)
    return np.degrees(np.arccos(np.clip((ours * theirs).sum(-1) / lengths, -1, 1)))


def test_a_fit_finds_normals(tmp_path, capsys):
    """Lamps of three colours show all normals in one photo. Adam stays 8 degrees off."""
    bumpy(tmp_path)
    tree = bpy.data.materials["Body"].node_tree
    texels = 8
    tree.nodes["Map"].image = bpy.data.images.load(
        even(str(tmp_path / "flat.exr"), texels, (0.5, 0.5, 1))
    )
    tree.nodes["Map"].image.colorspace_settings.name = "Non-Color"
    for index in range(3):
        lamp = made.light(f"Sun {index}", "SUN", energy=2.0, color=np.eye(3)[index])
        lamp.rotation_euler = (0.7, 0.0, 2 * np.pi * index / 3)
    path = made.save(tmp_path / "scene.blend")
    y, x = (np.mgrid[:texels, :texels] + 0.5) * 2 * np.pi / texels
    wanted = np.dstack([0.3 * np.cos(x) * np.sin(y), 0.3 * np.sin(x), np.ones_like(x)])
    wanted = (0.5 + 0.5 * wanted / np.linalg.norm(wanted, axis=2, keepdims=True)).astype("f4")
    shown = build(fields.with_fields(made.read(), [field().starting_at(wanted)]))
    film = native.core().render(shown, "Camera", SIZE, SIZE, 1024, seed=99)
    native.image().write_exr(str(tmp_path / "photo.exr"), film.image)
    assert angles(field().values, wanted).mean() > 10
    status, report, _ = command(
        capsys, "fit", path, "--fit", "Body:Map.image",
        "--photo", f"Camera={tmp_path / 'photo.exr'}", "--height", str(SIZE), "--threads", "1",
        "--out", str(tmp_path / "out"), "--iterations", "20", "--spp", "16",
    )  # fmt: skip
    assert status == 0, report
    row = report["parameters"]["Body:Map.image"]
    found, _, _ = native.image().read(f"{report['folder']}/{row['files'][0]}", as_linear=False)
    off = angles(found, wanted)
    assert off.mean() < 3, off
    assert off.max() < 10, off
    assert np.linalg.norm(2 * found.astype(float) - 1, axis=2) == pytest.approx(1, abs=1e-5)
