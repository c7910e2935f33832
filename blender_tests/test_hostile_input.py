# SPDX-License-Identifier: GPL-3.0-or-later
"""Input that no program would write: exit status 2 with object, cause and cure, never a traceback,
nothing written."""

import math
import os

import bpy
import made_scenes as made
import numpy as np
import pytest
from refusals import assert_fit_refused, files_of
from test_bad_input import _good, _good_photo, _more

from selenite import native
from selenite.cli import main

pytestmark = pytest.mark.blender


def _no_pixels(folder):
    arguments = _good(folder)
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 4
    bpy.context.scene.render.resolution_percentage = 1
    return arguments


def _without_area(folder):
    made.camera()
    mesh = bpy.data.meshes.new("Flat")
    mesh.from_pydata([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [], [(0, 1, 2)])
    mesh.materials.append(made.material())
    made.add("Flat", mesh)
    return [*_good_photo(folder), "--fit=Body:ior"]


def _black_photo(folder):
    made.studio()
    photo = made.photo(folder / "photo.png", value=0.0)
    return [f"--photo=Camera={photo}", "--loss=brightness-independent-mse"]


def _folder_as_photo(folder):
    made.studio()
    return [f"--photo=Camera={folder}"]


def _pipe_as_photo(folder):
    made.studio()
    os.mkfifo(folder / "pipe.png")
    return [f"--photo=Camera={folder / 'pipe.png'}"]


def _loop_as_photo(folder):
    made.studio()
    (folder / "loop.png").symlink_to(folder / "loop.png")
    return [f"--photo=Camera={folder / 'loop.png'}"]


def _name_too_long(folder):
    made.studio()
    return [f"--photo=Camera={'x' * 300}.png"]


def _grid(content, name="grid.npy"):
    def make(folder):
        made.smoke()
        (folder / name).write_bytes(content)
        return [*_good_photo(folder), f"--grid=Smoke:albedo_grid={folder / name}",
                "--fit=Smoke:albedo_grid"]  # fmt: skip

    return make


def _nan_world(folder):
    arguments = _good(folder)
    node = bpy.context.scene.world.node_tree.nodes["Background"]
    node.inputs["Strength"].default_value = math.nan
    return arguments


def _nan_sky(folder):
    """A float image tagged sRGB: its code values are worked out anew."""
    arguments = _good(folder)
    pixels = np.full((4, 8, 3), 0.5, np.float32)
    pixels[1, 1] = math.nan
    native.image().write_exr(str(folder / "sky.exr"), pixels)
    texture = made.environment(bpy.context.scene.world, np.ones((4, 8, 3), np.float32))
    texture.image = bpy.data.images.load(str(folder / "sky.exr"))
    texture.image.colorspace_settings.name = "sRGB"
    return arguments


def _nan_colours(folder):
    arguments = _good(folder)
    layer = bpy.data.meshes["Body"].color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    layer.data[3].color = (math.nan, 0, 0, 1)
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Paint"
    made.link(material, node.outputs["Color"])
    return [*arguments, "--fit=Body:ior"]


def _nan_matrix(folder):
    arguments = _good(folder)
    bpy.data.objects["Body"].location.x = math.nan
    return arguments


def _nan_lens(folder):
    arguments = _good(folder)
    bpy.data.cameras["Camera"].shift_x = math.nan
    return arguments


CASES = {
    "no pixels": (_no_pixels, "Scene 'Scene': a render has 0 x 0 pixels"),
    "no area": (_without_area, "Mesh 'Flat': none of its 1 triangles has an area"),
    "black photo": (_black_photo, "Photo 'Camera': it is black"),
    "folder as photo": (_folder_as_photo, "it is a folder"),
    "pipe as photo": (_pipe_as_photo, "it is a pipe or a device, not a file"),
    "loop as photo": (_loop_as_photo, "too many levels of symbolic links"),
    "name too long": (_name_too_long, "file name too long"),
    "empty grid": (_grid(b""), "grid.npy': cannot be read"),
    "archive as grid": (_grid(b"PK\x03\x04" + bytes(80)), "grid.npy': cannot be read"),
    "pickle as grid": (_grid(b"\x80\x04K\x01."), "grid.npy': cannot be read"),
    "half a grid": (_grid(b"VOL\x03", "grid.vol"), "it is shorter than a header"),
    "voxels": (
        _more("--grid=Body:base_color_texture=" + "9" * 5000, "--fit=Body:base_color_texture"),
        "texels along each side",
    ),
    "NaN world": (_nan_world, "World 'Studio': strength: nan is not a finite number"),
    "NaN sky": (_nan_sky, "Image 'sky.exr': it contains NaN or infinite pixels"),
    "NaN colours": (_nan_colours, "Mesh 'Body': its colour attribute 'Paint' has numbers"),
    "NaN matrix": (_nan_matrix, "Object 'Body': its matrix holds an infinite number"),
    "NaN shift": (_nan_lens, "Camera 'Camera': its shift x has a number"),
    "threads": (_more("--threads=2000"), "Setting 'threads': 2000 lies outside [0, 1024]"),
    "height": (_more("--height=0"), "Setting 'height': 0 lies outside [1, 65536]"),
    "picture spp": (_more("--picture-spp=2000000"), "lies outside [1, 1048576]"),
    "seed": (_more("--seed=-1"), "Setting 'seed': -1 lies outside [0, 2147483647]"),
    "tolerance": (_more("--tolerance=inf"), "Setting 'tolerance': inf lies outside"),
    "many iterations": (_more("--iterations=" + "9" * 400), "Setting 'iterations'"),
    "out below a file": (_more("--out=scene.blend/x"), "scene.blend' is not a folder"),
    "save to a device": (_more("--save=/dev/null"), "it is a pipe or a device"),
}


@pytest.mark.parametrize("case", CASES)
def test_fit_refuses(case, tmp_path, monkeypatch, capsys):
    assert_fit_refused(CASES[case], tmp_path, monkeypatch, capsys)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["render", "scene.blend", "--out=o.exr", "--width=65536", "--height=65536"], "pixels"),
        (["render", "scene.blend", "--out=o.exr", "--threads=2000"], "2000 lies outside [0, 1024]"),
        (["render", "scene.blend", "--out=o.exr", "--spp=99999999"], "lies outside [1, 1048576]"),
        (["render", "scene.blend", "--out=o.exr", f"--seed={1 << 64}"], "Argument --seed"),
        (["render", "scene.blend", "--out=o.exr", "--sem=o.exr"], "the picture goes there"),
        (["render", "scene.blend", "--out=text.blend/o.exr"], "its folder does not exist"),
        (["render", ".", "--out=o.exr"], "File '.': it is a folder"),
        (["check", "/dev/zero"], "it is a pipe or a device"),
        (["check", "~nobody-of-that-name/a.blend"], "it does not exist"),
        (["check", "x" * 300], "file name too long"),
        (["check", "empty.blend"], "empty.blend': cannot be opened"),
        (["check", "half.blend"], "half.blend': "),
        (["next-camera", "list.json"], "Run file: its schema is None"),
        (["next-camera", "scene.blend", "--threads=-1"], "Setting 'threads'"),
        (["fit", "--resume=text.blend"], "Folder '"),
        (["trade", "scene.blend", "--out=text.blend/x"], "is not a folder"),
        (["gradient", "scene.blend", "--parameter=Body:ior", "--out-dir=text.blend"], "a file"),
    ],
)
def test_other_commands_refuse(words, expected, tmp_path, monkeypatch, capsys):
    made.studio()
    made.save(tmp_path / "scene.blend")
    (tmp_path / "text.blend").write_text("this is no scene")
    (tmp_path / "empty.blend").write_bytes(b"")
    whole = (tmp_path / "scene.blend").read_bytes()
    (tmp_path / "half.blend").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "list.json").write_text("[]")
    monkeypatch.chdir(tmp_path)
    before = files_of(tmp_path)
    status = main(words)
    said = capsys.readouterr().err
    assert status == 2, said
    assert expected in said and "Traceback" not in said and "internal error" not in said
    assert files_of(tmp_path) == before


def test_drivers_that_do_not_run_are_named(tmp_path, capsys):
    """The command line runs no script of a file; what needs none is evaluated all the same."""
    ball = made.sphere(material=made.material())
    made.camera()
    made.world()
    simple = ball.driver_add("location", 0).driver
    simple.expression = "1 + 0.5"
    python = ball.driver_add("location", 1).driver
    python.expression = "__import__('os').getpid()"
    scene = made.save(tmp_path / "scene.blend")
    assert main(["check", scene]) == 0
    said = capsys.readouterr().err
    (line,) = [line for line in said.splitlines() if "driver" in line]
    assert "Object 'Body': the driver of 'location' has the Python expression '__import__" in line
    assert "its saved value counts" in line
    assert bpy.data.objects["Body"].matrix_world.translation.x == pytest.approx(1.5)
    assert bpy.data.objects["Body"].matrix_world.translation.y == pytest.approx(0)
