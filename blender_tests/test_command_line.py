# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands on a scene made by script: contents of JSON, files, result folder and run.json."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.capture.request import CaptureRequest
from selenite.cli import main
from selenite.fit.request import RunRequest, UnknownRequest, read_run
from selenite.fit.settings import PRESETS, FitSettings
from selenite.report import results

pytestmark = pytest.mark.blender

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def scene(tmp_path):
    """A saved scene: rough grey sphere under a grey sky and a lamp."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    return made.save(tmp_path / "scene.blend")


def exr(path):
    """Pixels of a file, linear."""
    return native.image().read(str(path))[0]


def test_check_says_what_was_understood(scene, capsys):
    status, report, _ = command(capsys, "check", scene)
    assert status == 0
    assert report["cameras"] == [{"name": "Camera", "kind": "PERSP", "width": 32, "height": 24}]
    assert report["owners"]["Body"]["parameters"]["roughness"]["value"] == [0.5]
    assert report["owners"]["World"]["datablock"] == "Studio"
    assert report["lights"] == [{"name": "Key Light", "object": "Key Light", "kind": "POINT"}]
    assert report["problems"] == []


def test_check_reports_problems_with_the_rest(tmp_path, capsys):
    made.studio()
    made.triangle("Wall").is_shadow_catcher = True
    status, report, _ = command(capsys, "check", made.save(tmp_path / "scene.blend"))
    assert status == 2
    assert report["problems"][0]["object"] == "Object 'Wall'"
    assert report["cameras"]


def test_check_reads_photos_as_a_fit_does(scene, tmp_path, capsys):
    good, square = made.photo(tmp_path / "a.png"), made.photo(tmp_path / "b.png", (24, 24))
    white = made.photo(tmp_path / "white.png", value=1.0)
    status, report, err = command(capsys, "check", scene, f"--photo=Camera={good}")
    assert status == 0, err
    assert [item["photo"] for item in report["captures"]] == [str(good)]
    photos = [f"--photo=Camera={item}" for item in (white, square)]
    masks = [f"--mask={item}={square}" for item in ("Camera", "Sid")]
    words = ("--silhouette", "-1", "--photo", f"Side={good}")
    status, report, err = command(capsys, "check", scene, *photos, *masks, *words)
    assert status == 2
    causes = {item["object"]: item["cause"] for item in report["problems"]}
    assert "24 x 24 pixels, camera 'Camera' renders 32 x 24" in causes[f"Photo '{square}'"]
    assert causes["Camera 'Side'"] == "it is not in the scene"
    assert causes["Photo 'Sid'"] == "a mask is given but no photo"
    assert causes["Argument --silhouette"] == "it is -1"
    assert "24 x 24 pixels, its photo 32 x 24" in causes[f"Mask '{square}'"]
    status, report, err = command(capsys, "check", scene, f"--photo=Camera={white}")
    assert status == 2 and "100% clipped" in report["problems"][0]["cause"]


@pytest.mark.parametrize("name", ["check", "fit", "next-camera"])
def test_a_captures_file_that_is_missing_is_the_only_problem(scene, tmp_path, capsys, name):
    words = (
        f"--captures={tmp_path / 'no.json'}",
        f"--mask=Camera={made.photo(tmp_path / 'a.png')}",
    )
    more = () if name == "check" else ("--fit=Body:base_color",)
    status, report, _ = command(capsys, name, scene, *words, *more)
    assert status == 2
    (problem,) = report["problems"]
    assert problem["cause"] == "the file does not exist" and problem["cure"] == "correct the path"


def test_render_writes_picture_and_error(scene, tmp_path, capsys):
    out, sem = tmp_path / "o.exr", tmp_path / "sem.exr"
    words = ("render", scene, "--out", str(out), "--sem", str(sem), "--spp", "8", "--width", "16")
    status, report, _ = command(capsys, *words)
    assert status == 0
    assert (report["width"], report["height"]) == (16, 12)
    pixels = exr(out)
    assert pixels.shape == exr(sem).shape == (12, 16, 3)
    np.testing.assert_allclose(pixels.mean(axis=(0, 1)), report["mean_image"], rtol=1e-5)
    np.testing.assert_allclose(pixels[0, 0], (0.5, 0.5, 0.5), rtol=1e-5)  # the sky


def test_render_with_other_values(scene, tmp_path, capsys):
    words = [
        "--set",
        "Body:base_color=0",
        "--set",
        "Key Light:power=0",
        "--set",
        "Studio:strength=2",
    ]
    _, plain, _ = command(capsys, "render", scene, "--out", str(tmp_path / "a.exr"), "--spp", "8")
    status, other, _ = command(
        capsys, "render", scene, "--out", str(tmp_path / "b.png"), "--spp", "8", *words
    )
    assert status == 0
    np.testing.assert_allclose(exr(tmp_path / "b.png")[0, 0], (1, 1, 1))  # 2 x 0.5, cut by PNG
    assert other["mean_image"] != plain["mean_image"]


def test_same_seed_same_bytes_whatever_the_threads(scene, tmp_path, capsys):
    for name, threads in (("a", "1"), ("b", "2")):
        out = str(tmp_path / f"{name}.exr")
        command(capsys, "render", scene, "--out", out, "--spp", "4", "--threads", threads)
    np.testing.assert_array_equal(exr(tmp_path / "a.exr"), exr(tmp_path / "b.exr"))


def test_gradient_json(scene, tmp_path, capsys):
    status, report, _ = command(
        capsys,
        "gradient",
        scene,
        "--parameter",
        "Body:base_color",
        "World:strength",
        "--parameter",
        "Key Light:power",
        "--spp",
        "64",
        "--repeat",
        "2",
        "--out-dir",
        str(tmp_path / "slopes"),
    )
    assert status == 0
    slopes = report["derivatives"]
    assert list(slopes) == ["Body:base_color", "World:strength", "Key Light:power"]
    assert np.shape(slopes["Body:base_color"]["value"]) == (3, 3)
    assert np.shape(slopes["World:strength"]["standard_error"]) == (1, 3)
    assert len(report["iteration_cpu_seconds"]) == 2 and min(report["iteration_cpu_seconds"]) > 0
    # radiance is linear in the emitters: the mean is the sum of power times slope
    sky = np.array(slopes["World:strength"]["value"][0])
    lamp = 40 * np.array(slopes["Key Light:power"]["value"][0])
    np.testing.assert_allclose(sky + lamp, report["mean_image"], rtol=1e-4)
    assert {"image.exr", "Body_base_color_2.exr", "Body_base_color_2_sem.exr"} <= set(
        report["files"]
    )
    assert exr(tmp_path / "slopes" / "Key_Light_power_0.exr").shape == (24, 32, 3)


@pytest.fixture
def painted(tmp_path):
    """The studio with an image of 4 x 2 linear numbers on the sphere."""
    made.studio()
    made.light("Key Light", energy=40)
    pixels = np.linspace(0.1, 0.9, 24, dtype=np.float32).reshape(2, 4, 3)
    native.image().write_exr(str(tmp_path / "paint.exr"), pixels)
    material = bpy.data.materials["Body"]
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(tmp_path / "paint.exr"))
    node.image.colorspace_settings.name = "Non-Color"
    material.node_tree.links.new(node.outputs["Color"], made.socket(material, "base_color"))
    return made.save(tmp_path / "painted.blend"), pixels


def test_gradient_by_the_texels_of_an_image(painted, tmp_path, capsys):
    scene, pixels = painted
    name, out = "Body:base_color_texture", str(tmp_path / "slopes")
    words = ("gradient", scene, "--spp=256", "--width=16", "--repeat=2", f"--out-dir={out}")
    status, report, _ = command(capsys, *words, "--parameter", name)
    assert status == 0
    slopes = np.array(report["derivatives"][name]["value"])
    error = np.array(report["derivatives"][name]["standard_error"])
    texels = exr(tmp_path / "slopes" / "Body_base_color_texture_texels.exr")
    assert texels.shape == pixels.shape
    # a shift of the image shifts every texel; red light is none of green's business
    np.testing.assert_allclose(texels.sum(axis=(0, 1)), np.diag(slopes), rtol=1e-4)
    np.testing.assert_array_equal(slopes[~np.eye(3, dtype=bool)], 0)
    assert (np.diag(slopes) > 20 * np.diag(error)).all() and (np.diag(error) > 0).all()
    assert len(report["iteration_cpu_seconds"]) == 2 and min(report["iteration_cpu_seconds"]) > 0
    assert set(report["files"]) == {path.name for path in (tmp_path / "slopes").iterdir()}

    _agrees_with_pictures(capsys, scene, tmp_path, pixels, np.diag(slopes), words[2:4])


def _agrees_with_pictures(capsys, scene, tmp_path, pixels, slopes, words):
    """With the difference of two pictures, of which one has a brighter image."""
    step = 0.02
    _, before, _ = command(capsys, "render", scene, f"--out={tmp_path / 'a.exr'}", *words)
    native.image().write_exr(str(tmp_path / "paint.exr"), pixels + np.float32(step))
    _, after, _ = command(capsys, "render", scene, f"--out={tmp_path / 'b.exr'}", *words)
    difference = (np.array(after["mean_image"]) - before["mean_image"]) / step
    np.testing.assert_allclose(difference, slopes, rtol=0.02)


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["Body:base_color_texture", "Body:ior"], "name it alone"),
        (["Ground:base_color_texture"], "no material 'Ground' takes its base colour from an image"),
    ],
)
def test_gradient_by_texels_refuses(painted, names, expected, capsys):
    assert main(["gradient", painted[0], "--parameter", *names]) == 2
    assert expected in capsys.readouterr().err


def test_gradient_by_texels_over_a_subsurface(painted, tmp_path, capsys):
    """Light that left the skin elsewhere took its colour from there."""
    made.principled(bpy.data.materials["Body"]).inputs["Subsurface Weight"].default_value = 0.5
    scene = made.save(tmp_path / "skin.blend")
    name = "Body:base_color_texture"
    words = ("--spp=2048", "--width=16")
    _, report, _ = command(capsys, "gradient", scene, *words, "--parameter", name)
    slopes = np.diag(report["derivatives"][name]["value"])
    _agrees_with_pictures(capsys, scene, tmp_path, painted[1], slopes, words)


def _fit_words(scene, tmp_path, *more):
    """Arguments of a fit whose photo is a render with base colour (.2, .6, .4)."""
    photo = str(tmp_path / "photo.exr")
    words = ["--spp", "256", "--set", "Body:base_color=.2,.6,.4"]
    assert main(["render", scene, "--out", photo, *words]) == 0
    return (
        "fit",
        scene,
        f"--photo=Camera={photo}",
        "--fit=Body:base_color",
        "--iterations=40",
        "--tolerance=0",
        "--height=16",
        f"--out={tmp_path / 'fits'}",
        *more,
    )


def test_fit_finds_the_colour_and_writes_everything(scene, tmp_path, capsys):
    saved = tmp_path / "fitted.blend"
    words = _fit_words(scene, tmp_path, f"--save={saved}")
    status, report, _ = command(capsys, *words)
    assert status == 0
    row = report["parameters"]["Body:base_color"]
    assert row["value"] == pytest.approx([0.2, 0.6, 0.4], abs=0.02)
    assert row["initial"] == pytest.approx([0.8, 0.4, 0.2])
    assert (row["minimum"], row["maximum"], row["unit"]) == (0.0, 1.0, "1")
    assert report["schema"] == results.SCHEMA
    folder = Path(report["folder"])
    names = {item.name for item in folder.iterdir()}
    pictures = ("initial", "optimised", "reference", "error")
    assert {f"Camera_{p}.{end}" for p in pictures for end in ("png", "exr")} <= names
    assert {"result.json", "run.json", "history.csv", "log.txt"} <= names
    stored = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert stored["parameters"] == report["parameters"]
    with (folder / "history.csv").open(encoding="utf-8") as file:
        history = list(csv.DictReader(file))
    assert len(history) >= report["iterations"] and "Body:base_color.g" in history[0]
    error = exr(folder / "Camera_error.exr").mean()
    initial = np.abs(exr(folder / "Camera_initial.exr") - exr(folder / "Camera_reference.exr"))
    assert error < 0.3 * initial.mean()
    bpy.ops.wm.open_mainfile(filepath=str(saved), load_ui=False)
    value = made.socket(bpy.data.materials["Body"], "base_color").default_value
    assert tuple(value)[:3] == pytest.approx(row["value"])
    bpy.ops.wm.open_mainfile(filepath=scene, load_ui=False)  # the scene itself is not touched
    value = made.socket(bpy.data.materials["Body"], "base_color").default_value
    assert tuple(value)[:3] == pytest.approx((0.8, 0.4, 0.2))


def test_run_json_reproduces_the_run(scene, tmp_path, capsys):
    """And says what was asked for: two runs that ignore an option would be alike, too."""
    bounds = "--bounds=Body:base_color=.1,.9"
    words = _fit_words(scene, tmp_path, "--seed=7", bounds, "--depth=3", "--tolerance=0.0001")
    _, first, _ = command(capsys, *words)
    run = Path(first["folder"]) / "run.json"
    asked = read_run(run)
    (unknown,) = asked.unknowns
    assert (unknown.minimum, unknown.maximum) == (0.1, 0.9)
    wanted = {"seed": 7, "depth": 3, "tolerance": 0.0001, "iterations": 40, "height": 16}
    assert {name: getattr(asked.settings, name) for name in wanted} == wanted
    again = f"--out={tmp_path / 'fits'}"
    _, second, _ = command(capsys, "fit", str(run), again)
    assert second["parameters"] == first["parameters"]
    assert second["folder"] != first["folder"]
    _, other, _ = command(capsys, "fit", str(run), again, "--seed=8")
    histories = [(Path(r["folder"]) / "history.csv").read_bytes() for r in (first, second, other)]
    assert histories[0] == histories[1] != histories[2]


def test_photo_and_camera_of_the_scene_and_packed_images(scene, tmp_path, capsys):
    """Without --photo: the camera's background image, here packed into the file."""
    path = made.photo(tmp_path / "grey.png")
    bpy.ops.wm.open_mainfile(filepath=scene, load_ui=False)
    image = bpy.data.images.load(str(path))
    image.pack()
    data = bpy.data.objects["Camera"].data
    data.background_images.new().image = image
    made.save(tmp_path / "packed.blend")
    path.unlink()
    words = ("--iterations=2", "--height=12", f"--out={tmp_path / 'fits'}")
    status, report, _ = command(capsys, "fit", str(tmp_path / "packed.blend"), *words)
    assert status == 0
    assert {name.partition(":")[2] for name in report["parameters"]} == {
        "base_color",
        "roughness",
        "transmission",
        "ior",
    }


def test_masked_pixels_do_not_count(scene, tmp_path, capsys):
    """A wrong half of the photo changes nothing when the mask excludes it."""
    words = list(_fit_words(scene, tmp_path))
    pixels = exr(tmp_path / "photo.exr")
    weight = np.ones_like(pixels)
    weight[:, 16:] = 0
    pixels[:, 16:] = 9
    native.image().write_exr(str(tmp_path / "photo.exr"), pixels)
    native.image().write_png(str(tmp_path / "mask.png"), weight)
    status, report, _ = command(capsys, *words, f"--mask=Camera={tmp_path / 'mask.png'}")
    assert status == 0
    value = report["parameters"]["Body:base_color"]["value"]
    assert value == pytest.approx([0.2, 0.6, 0.4], abs=0.03)


def test_a_failed_write_leaves_no_result_folder(scene, tmp_path, capsys, monkeypatch):
    words = _fit_words(scene, tmp_path)

    def full(*_arguments):
        raise OSError("no space left on device")

    monkeypatch.setattr(results, "_write_pictures", full)
    assert main(list(words)) == 1
    assert "no space left" in capsys.readouterr().err
    assert [item.suffix for item in (tmp_path / "fits").iterdir()] == [".unfinished"]


def test_run_request_makes_the_round_trip(tmp_path):
    request = RunRequest(
        scene="/scenes/a b.blend",
        unknowns=(
            UnknownRequest("Body", "base_color", (0.1, 0.2, 0.3), 0.01, 0.9, 0.05),
            UnknownRequest("World", "strength"),
        ),
        captures=(
            CaptureRequest("Camera", "photo.png", "mask.png"),
            CaptureRequest("Side", "b.exr"),
        ),
        settings=FitSettings(loss="mse", iterations=7, tolerance=0.0, seed=3),
    )
    path = tmp_path / "run.json"
    path.write_text(json.dumps(request.as_json()), encoding="utf-8")
    assert read_run(path) == request


@pytest.mark.parametrize("name", PRESETS)
def test_presets_are_valid(name):
    assert PRESETS[name].problems() == []
    assert FitSettings.from_json(PRESETS[name].as_json()) == PRESETS[name]


def test_as_a_process_stdout_holds_one_json_object(scene):
    """Blender prints to stdout too; the process must also end, which bpy sometimes does not."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "addon")}
    done = subprocess.run(
        [sys.executable, "-m", "selenite", "check", scene, "--json"],
        env=environment,
        capture_output=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    assert json.loads(done.stdout)["objects"] == 1
    done = subprocess.run(
        [sys.executable, "-m", "selenite", "check", "nowhere.blend"],
        env=environment,
        capture_output=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, b"")
    assert b"nowhere.blend" in done.stderr
