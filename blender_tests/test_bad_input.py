# SPDX-License-Identifier: GPL-3.0-or-later
"""Every kind of bad input: exit status 2, one line with object, cause and cure, nothing written."""

import math

import bpy
import made_geometry as geometry
import made_scenes as made
import pytest
from refusals import assert_fit_refused, files_of

from selenite.cli import main

pytestmark = pytest.mark.blender


def _good(folder):
    """A scene that fits, with a photo for its camera; returns the arguments of `fit`."""
    made.studio()
    return [f"--photo=Camera={made.photo(folder / 'photo.png')}"]


def _no_camera(folder):
    made.sphere(material=made.material())
    return _good_photo(folder)


def _good_photo(folder):
    return [f"--photo=Camera={made.photo(folder / 'photo.png')}"]


def _only_panoramic(folder):
    made.sphere(material=made.material())
    made.camera(type="PANO")
    return _good_photo(folder)


def _no_photo(_folder):
    made.studio()
    return []


def _missing_photo(folder):
    made.studio()
    return [f"--photo=Camera={folder / 'nowhere.png'}"]


def _text_as_photo(folder):
    made.studio()
    path = folder / "photo.png"
    path.write_text("this is no picture")
    return [f"--photo=Camera={path}"]


def _half_a_photo(folder):
    made.studio()
    path = made.photo(folder / "photo.png")
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    return [f"--photo=Camera={path}"]


def _photo_of_another_aspect(folder):
    made.studio()
    return [f"--photo=Camera={made.photo(folder / 'photo.png', size=(32, 32))}"]


def _photo_for_no_camera(folder):
    return [*_good(folder), f"--photo=Side={folder / 'photo.png'}"]


def _two_masks_of_one_photo(folder):
    masks = [made.photo(folder / f"mask{number}.png") for number in (1, 2)]
    return [*_good(folder), *(f"--mask=Camera={path}" for path in masks)]


def _mask_of_a_second_photo(folder):
    return [*_good(folder), f"--mask=Camera#2={made.photo(folder / 'mask.png')}"]


def _mask_of_another_shape(folder):
    return [*_good(folder), f"--mask=Camera={made.photo(folder / 'mask.png', size=(16, 16))}"]


def _mask_of_nothing(folder):
    mask = made.photo(folder / "mask.png", value=0.0)
    return [*_good(folder), f"--mask=Camera={mask}"]


def _photo_argument(folder):
    return [*_good(folder), "--photo=photo.png"]


def _other_shader(folder):
    arguments = _good(folder)
    tree = bpy.data.materials["Body"].node_tree
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    toon = tree.nodes.new("ShaderNodeBsdfToon")
    tree.links.new(toon.outputs[0], output.inputs["Surface"])
    return arguments


def _linked_socket(folder):
    arguments = _good(folder)
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeAmbientOcclusion")
    material.node_tree.links.new(node.outputs[1], made.socket(material, "roughness"))
    return [*arguments, "--fit=Body:Principled BSDF.IOR"]


def _driven_socket(folder):
    arguments = _good(folder)
    made.socket(bpy.data.materials["Body"], "roughness").driver_add("default_value")
    return [*arguments, "--fit=Body:roughness"]


def _library_material(folder):
    made.material("Far").use_fake_user = True
    library = made.save(folder / "library.blend")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(library, link=True) as (_, wanted):
        wanted.materials = ["Far"]
    made.sphere(material=bpy.data.materials["Far"])
    made.camera()
    return [*_good_photo(folder), "--fit=Far:roughness"]


def _points(folder):
    arguments = _good(folder)
    geometry.cloud_of_points("Dots")
    return arguments


def _nothing_to_render(folder):
    made.camera()
    return _good_photo(folder)


def _value_out_of_range(folder):
    arguments = _good(folder)
    made.socket(bpy.data.materials["Body"], "ior").default_value = -5
    return arguments


def _value_not_a_number(folder):
    arguments = _good(folder)
    made.socket(bpy.data.materials["Body"], "roughness").default_value = math.nan
    return arguments


def _two_candidates(folder):
    arguments = _good(folder)
    made.triangle("Floor", made.material("Floor"))
    return arguments


def _more(*words):
    def make(folder):
        return [*_good(folder), *words]

    return make


def _out_is_a_file(folder):
    (folder / "taken").write_text("")
    return [*_good(folder), f"--out={folder / 'taken'}"]


CASES = {
    "no camera": (_no_camera, "Scene 'Scene': it has no camera"),
    "only a panoramic camera": (_only_panoramic, "Camera 'Camera': it is pano"),
    "no photo": (_no_photo, "Fit: there is no photo"),
    "photo missing": (_missing_photo, "nowhere.png': the file does not exist"),
    "photo unreadable": (_text_as_photo, "photo.png': cannot be read"),
    "photo truncated": (_half_a_photo, "photo.png': cannot be read"),
    "aspect": (_photo_of_another_aspect, "it is 32 x 32 pixels, camera 'Camera' renders 32 x 24"),
    "more photos than cameras": (_photo_for_no_camera, "Camera 'Side': it is not in the scene"),
    "two masks of one photo": (_two_masks_of_one_photo, "Photo 'Camera': it has two masks"),
    "mask of no photo": (
        _mask_of_a_second_photo,
        "Photo 'Camera#2': a mask is given but no photo; add --photo Camera=FILE",
    ),
    "mask of another shape": (_mask_of_another_shape, "it is 16 x 16 pixels, its photo 32 x 24"),
    "mask of nothing": (_mask_of_nothing, "no pixel of it can be used"),
    "photo argument": (_photo_argument, "it is not CAMERA=FILE"),
    "other shader": (_other_shader, "Material 'Body': node 'Toon BSDF' (Toon BSDF) is a shader"),
    "linked socket": (
        _linked_socket,
        "Material 'Body': node 'Ambient Occlusion' (Ambient Occlusion)",
    ),
    "driven socket": (_driven_socket, "Parameter 'Body:roughness': driven; remove the driver"),
    "library material": (_library_material, "Parameter 'Far:roughness': linked from library"),
    "points": (_points, "Object 'Dots': it renders as a cloud of points"),
    "nothing to render": (_nothing_to_render, "Scene 'Scene': nothing with faces"),
    "value out of range": (_value_out_of_range, "input 'IOR': -5 lies outside"),
    "value not a number": (_value_not_a_number, "input 'Roughness': nan is not a finite number"),
    "two candidates": (_two_candidates, "candidates: 'Body', 'Floor'"),
    "owner": (_more("--fit=Bdy:ior"), "no material, light or world of the scene is called 'Bdy'"),
    "parameter": (_more("--fit=Body:gloss"), "a material has no parameter 'gloss'"),
    "fit argument": (_more("--fit=roughness"), "is not of the form OWNER:PARAMETER"),
    "bounds reversed": (_more("--bounds=Body:ior=2,1.5"), "its bounds [2, 1.5]"),
    "bounds outside": (_more("--bounds=Body:roughness=-1,1"), "its bounds [-1, 1]"),
    "bounds NaN": (_more("--bounds=Body:ior=nan,2"), "'nan,2' is not finite"),
    "bounds count": (_more("--bounds=Body:ior=2"), "it has 1 numbers"),
    "start outside": (_more("--start=Body:ior=7"), "start: 7 lies outside its bounds [1, 2.5]"),
    "start NaN": (_more("--start=Body:ior=nan"), "'nan' is not finite"),
    "start not fitted": (
        _more("--start=Body:alpha=.5"),
        "Parameter 'Body:alpha': it is not fitted",
    ),
    "given twice": (_more("--start=Body:ior=1.4", "--start=Body:ior=1.4"), "given twice"),
    "iterations": (_more("--iterations=0"), "Setting 'iterations': 0 lies outside"),
    "learning rate": (_more("--learning-rate=nan"), "Setting 'learning_rate': nan lies outside"),
    "loss": (_more("--loss=l2"), "Setting 'loss': 'l2' is not known"),
    "spp": (_more("--spp=1"), "loss 'robust' needs 2 samples"),
    "optimiser": (_more("--optimiser=sgd"), "Setting 'optimiser': 'sgd' is not known"),
    "out": (_out_is_a_file, "taken': it is a file"),
    "save": (_more("--save=nowhere/out.blend"), "its folder does not exist"),
    "save ending": (_more("--save=out.txt"), "its ending '.txt' is not known"),
}


@pytest.mark.parametrize("case", CASES)
def test_fit_refuses(case, tmp_path, monkeypatch, capsys):
    assert_fit_refused(CASES[case], tmp_path, monkeypatch, capsys)


def test_all_problems_are_told_at_once(tmp_path, capsys):
    arguments = _no_photo(tmp_path)
    geometry.cloud_of_points("Dots")
    scene = made.save(tmp_path / "scene.blend")
    assert main(["fit", scene, *arguments, "--fit=Body:gloss", "--iterations=0"]) == 2
    text = capsys.readouterr().err
    for words in ("'Dots'", "'gloss'", "there is no photo", "'iterations'"):
        assert words in text


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["check", "nowhere.blend"], "File 'nowhere.blend': it does not exist"),
        (["check", "text.blend"], "text.blend': cannot be opened"),
        (["render", "scene.blend", "--camera=Front", "--out=o.exr"], "Camera 'Front'"),
        (["render", "scene.blend", "--out=o.bmp"], "its ending '.bmp' is not known"),
        (["render", "scene.blend", "--out=no/o.exr"], "its folder does not exist"),
        (["render", "scene.blend", "--out=o.exr", "--width=0"], "Argument --width: it is 0"),
        (["render", "scene.blend", "--out=o.exr", "--set=Body:ior=nan"], "is not finite"),
        (["render", "scene.blend", "--out=o.exr", "--set=Body:ior=-1"], "-1 lies outside"),
        (["render", "scene.blend", "--out=o.exr", "--set=Body:ior=1,2"], "takes 1 number"),
        (["render", "scene.blend", "--out=o.exr", "--set=Body"], "has no '='"),
        (["gradient", "scene.blend", "--parameter", "Body:gloss"], "no parameter 'gloss'"),
        (["fit", "run.json"], "Run file: its schema is 99"),
        (["fit", "broken.json"], "broken.json': cannot be read"),
    ],
)
def test_other_commands_refuse(words, expected, tmp_path, monkeypatch, capsys):
    made.studio()
    made.save(tmp_path / "scene.blend")
    (tmp_path / "text.blend").write_text("this is no scene")
    (tmp_path / "run.json").write_text('{"schema": 99}')
    (tmp_path / "broken.json").write_text("{")
    monkeypatch.chdir(tmp_path)
    before = files_of(tmp_path)
    assert main(words) == 2
    assert expected in capsys.readouterr().err
    assert files_of(tmp_path) == before


@pytest.mark.parametrize("words", [[], ["paint"], ["render", "scene.blend"], ["fit", "--spp=x"]])
def test_wrong_usage_is_bad_input(words):
    assert main(words) == 2
