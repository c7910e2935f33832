# SPDX-License-Identifier: GPL-3.0-or-later
"""What the terminal tells a user: the name that was meant, the camera that is taken, and the gains
that a fit has found."""

import re
from pathlib import Path

import bpy
import made_scenes as made
import pytest
from command_line import command

from selenite import native
from selenite.cli import main
from selenite.report.table import TITLES

pytestmark = pytest.mark.blender


@pytest.fixture
def scene(tmp_path):
    """A ball under a grey sky, and two cameras; the one at the side is active."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    bpy.context.scene.camera = made.camera("Side", distance=3.0)
    return made.save(tmp_path / "scene.blend")


@pytest.mark.parametrize(
    ("words", "meant", "permitted"),
    [
        (["--fit=Body:rougness"], "Body:rougness': a material has no", "'roughness'"),
        (["--fit=Body:base_colour_texture"], "a material has no", "'base_color_texture'"),
        (["--fit=World:enviroment"], "a world has no", "'environment'"),
        (["--fit=body:roughness"], "no material, light or world", "'Body'"),
        (["--fit=Body:roughness", "--photo=Sid=p.png"], "Camera 'Sid'", "'Side'"),
        (["--fit=Body:roughness", "--start=Body:rougness=.3"], "is not fitted", "'Body:roughness'"),
        (["--fit=Body:roughness", "--loss=robst"], "Setting 'loss'", "'robust'"),
    ],
)
def test_a_misspelt_name_is_answered_with_the_one_that_was_meant(
    scene, capsys, words, meant, permitted
):
    assert main(["fit", scene, *words]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if meant in line]
    assert f"did you mean {permitted}?" in lines[0]


def test_an_object_in_place_of_its_material_is_answered_with_the_material(scene, capsys):
    bpy.data.objects["Body"].name = "Thing"
    bpy.data.objects.new("Nothing", None)
    path = made.save(Path(scene).with_name("named.blend"))
    for name in ("roughness", "base_color_texture"):
        assert main(["fit", path, f"--fit=Thing:{name}"]) == 2
        assert "use one of 'Body', which the object of that name has" in capsys.readouterr().err
    assert main(["fit", path, "--fit=Nothing:roughness"]) == 2
    assert "use one of 'Body'" in capsys.readouterr().err


def test_the_permitted_names_are_those_of_the_command(scene, tmp_path, capsys):
    """Images can be fitted; a render takes one value."""
    main(["fit", scene, "--fit=Body:x", "--fit=World:x"])
    said = capsys.readouterr().err
    assert "'base_color_texture'" in said and "'environment'" in said
    main(["render", scene, f"--out={tmp_path / 'o.exr'}", "--set=Body:x=1", "--set=World:x=1"])
    said = capsys.readouterr().err
    assert "'base_color'" in said and "'strength'" in said
    assert "'base_color_texture'" not in said and "'environment'" not in said


def test_without_a_name_the_active_camera_renders(scene, tmp_path, capsys):
    out = str(tmp_path / "o.exr")
    pictures = {}
    for words in ((), ("--camera=Side",), ("--camera=Camera",)):
        status, report, _ = command(capsys, "render", scene, "--out", out, "--spp=1", *words)
        assert status == 0
        pictures[words] = native.image().read(out)[0].tobytes()
        assert report["camera"] == ("Camera" if words == ("--camera=Camera",) else "Side")
    assert pictures[()] == pictures["--camera=Side",] != pictures["--camera=Camera",]
    slope = ("--parameter=Body:roughness", "--spp=1")
    assert command(capsys, "gradient", scene, *slope)[0] == 0
    bpy.context.scene.camera = None
    none_active = made.save(tmp_path / "none.blend")
    assert main(["render", none_active, "--out", out]) == 2
    assert "no active one, and --camera names none; use one of" in capsys.readouterr().err


def fit(capsys, scene, tmp_path, brightness, *more):
    """To a render of another colour, as an exposure of another brightness has it."""
    photo = str(tmp_path / "photo.exr")
    command(
        capsys, "render", scene, "--camera=Camera", "--out", photo, "--spp=512",
        "--set=Body:base_color=.2,.6,.4",
    )  # fmt: skip
    native.image().write_exr(photo, native.image().read(photo)[0] * brightness)
    status, report, said = command(
        capsys, "fit", scene, f"--photo=Camera={photo}", "--height=24", "--spp=16",
        f"--out={tmp_path / 'fits'}", *more,
    )  # fmt: skip
    assert status == 0, report
    return report, said


def rows_of(said):
    """The table in the terminal: name -> its other cells."""
    lines = said.splitlines()
    (at,) = [index for index, line in enumerate(lines) if line.startswith("parameter ")]
    assert re.split(r"  +", lines[at]) == list(TITLES)
    found = {}
    for line in lines[at + 1 :]:
        name, *cells = re.split(r"  +", line)
        if not cells:
            break
        found[name] = cells
    return found, lines[at + 1 + len(found) :]


@pytest.mark.parametrize(("kind", "count"), [("scalar", 1), ("rgb", 3)])
def test_the_gains_that_were_found_are_said(scene, tmp_path, capsys, kind, count):
    more = ("--fit=Body:roughness", f"--gain={kind}", "--align")
    report, said = fit(capsys, scene, tmp_path, 1.5, *more)
    rows, _ = rows_of(said)
    row = report["captures"]["Camera"]
    gains = [cells for name, cells in rows.items() if name.startswith("Photo Camera: gain")]
    assert len(gains) == count
    for at, (start, fitted, interval) in enumerate(gains):
        assert start == "1" and float(fitted) == pytest.approx(row["gain"][at], rel=0.01)
        ends = [float(x) for x in interval.split(" to ")]
        assert ends == pytest.approx(list(row["gain_interval_90"][at]), rel=0.01)
    (shift,) = (cells for name, cells in rows.items() if name.endswith("shift [pixels]"))
    assert [float(x) for x in shift[1].split(", ")] == pytest.approx(row["shift"][:2], abs=0.01)


def test_a_fit_ends_with_one_table_and_three_sentences_at_most(scene, tmp_path, capsys):
    """Model, stages, losses and the multi-start are in log.txt."""
    report, said = fit(capsys, scene, tmp_path, 1.0, "--fit=Body:base_color,roughness")
    rows, rest = rows_of(said)
    names = [f"Body:base_color {name}" for name in ("red", "green", "blue")]
    assert list(rows) == [*names, "Body:roughness"]
    found = report["parameters"]["Body:roughness"]
    start, fitted, *more = rows["Body:roughness"]
    assert float(start) == found["initial"] == 0.5
    assert float(fitted) == pytest.approx(found["value"], rel=0.01)
    if found["interval_90"]:
        ends = [float(x) for x in more[0].split(" to ")]
        assert ends == pytest.approx(found["interval_90"], rel=0.05)
        assert more[1] in ("determined", "weak")
    else:
        assert more == ["not determined"]
    assert rest[-1].endswith(f"results in {report['folder']}") and 1 <= len(rest[:-1]) <= 3
    log = (Path(report["folder"]) / "log.txt").read_text(encoding="utf-8")
    for words in ("Model: surface", "Multi-start: "):
        assert words in log and words.lower() not in said.lower()


def test_gains_beside_an_unknown_light_are_said_at_its_level(scene, tmp_path, capsys):
    more = ("--fit=World:environment", "--environment-size=8", "--gain=scalar", "--iterations=4")
    _, said = fit(capsys, scene, tmp_path, 1.5, "--fit=Body:roughness", *more)
    rows, rest = rows_of(said)
    assert "Photo Camera: gain" in rows
    assert "The gains hold at this level of World:environment" in " ".join(rest)


def test_several_materials_without_a_choice_give_a_command_to_copy(scene, capsys):
    made.sphere("Aside", made.material("Aside", roughness=0.2)).location.x = 3.0
    bpy.context.view_layer.objects.active = bpy.data.objects["Body"]
    path = made.save(Path(scene).with_name("two.blend"))
    assert main(["fit", path, "--photo=Camera=a photo.png"]) == 2
    said = capsys.readouterr().err
    (line,) = [text for text in said.splitlines() if "which material to fit" in text]
    assert line.lower().count("fit: ") == 1
    command = f"selenite fit {path} --fit Body:base_color,roughness,transmission,ior"
    assert f"{command} --photo 'Camera=a photo.png'" in line


def test_of_photos_without_a_gain_nothing_is_said(scene, tmp_path, capsys):
    """The result folder has their keys all the same, for those who read it."""
    report, said = fit(capsys, scene, tmp_path, 1.0, "--fit=Body:base_color", "--iterations=2")
    assert "Body:base_color red" in said
    assert not [line for line in said.splitlines() if line.startswith("Photo Camera: ")]
    row = report["captures"]["Camera"]
    assert row["gain"] == [1, 1, 1] and row["gain_interval_90"] is None
    assert row["shift"] == [0, 0, 0] and row["residual_rms"] >= 0 and row["mask_share"] == 1
