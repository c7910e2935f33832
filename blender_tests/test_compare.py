# SPDX-License-Identifier: GPL-3.0-or-later
"""Photos that a fit does not see: held out in the fit, and by `selenite compare`."""

import json
from pathlib import Path

import made_scenes as made
import numpy as np
import pytest
from command_line import command

from selenite import native
from selenite.capture.scene_captures import captures_of
from selenite.cli import main
from selenite.commands.fitted.compare import compared
from selenite.commands.parser import build_parser
from selenite.report.hold_out import squared_error

pytestmark = [pytest.mark.blender, pytest.mark.usefixtures("addon")]

GAIN = 1.25
COLOUR = (0.2, 0.6, 0.4)


@pytest.fixture
def photos(tmp_path):
    """A scene, the file of a photo of its true colour, and one that is longer exposed."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    scene = made.save(tmp_path / "scene.blend")
    colour = ",".join(map(str, COLOUR))
    words = ["--spp", "512", "--set", f"Body:base_color={colour}"]
    for seed, (name, gain) in enumerate({"seen.exr": 1.0, "unseen.exr": GAIN}.items()):
        path = str(tmp_path / name)
        assert main(["render", scene, "--out", path, "--seed", str(seed), *words]) == 0
        pixels = native.image().read(path)[0]
        native.image().write_exr(path, np.ascontiguousarray(gain * pixels))
    return scene


def captures(tmp_path, *rows):
    path = tmp_path / "captures.json"
    path.write_text(json.dumps({"schema": 1, "captures": list(rows)}))
    return str(path)


SEEN = {"id": "seen", "camera": "Camera", "photo": "seen.exr", "response": "linear"}
UNSEEN = {"id": "unseen", "camera": "Camera", "photo": "unseen.exr", "response": "linear"}


def fit(capsys, tmp_path, scene, file, *more):
    return command(
        capsys, "fit", scene, "--captures", file, "--fit=Body:base_color", "--height=16",
        "--picture-spp=64", f"--out={tmp_path / 'fits'}", *more,
    )  # fmt: skip


def test_a_photo_hold_out_does_not_move_the_fit_and_judges_it(photos, tmp_path, capsys):
    file = captures(tmp_path, SEEN, UNSEEN | {"hold_out": True})
    status, report, err = fit(capsys, tmp_path, photos, file)
    assert status == 0, err
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.02)
    assert list(report["captures"]) == ["seen"]
    found = report["hold_out"]
    assert found["relative_error"] == pytest.approx(1 - 1 / GAIN, abs=0.01)
    row = found["captures"]["unseen"]
    assert row["own_gain"] == pytest.approx([GAIN] * 3, rel=0.01)
    assert row["with_own_gain"]["at_most"] < 0.02
    assert (Path(report["folder"]) / "hold_out.png").is_file()
    assert "Held out: 1 photo, off by 20" in err
    stored = json.loads((Path(report["folder"]) / "run.json").read_text())
    assert [item.get("hold_out", False) for item in stored["captures"]] == [False, True]
    # Afterwards: what the fit held out, then the photo that it has seen.
    status, again, err = command(capsys, "compare", report["folder"])
    assert status == 0, err
    assert again["captures"]["unseen"]["relative_error"] == pytest.approx(
        found["relative_error"], abs=0.005
    )
    assert (Path(again["folder"]) / "contact_sheet.png").is_file()
    file = captures(tmp_path, SEEN)
    words = ("--captures", file, "--out", str(tmp_path / "seen"))
    status, again, err = command(capsys, "compare", report["folder"], *words)
    assert status == 0, err
    assert again["captures"]["seen"]["fitted"] and again["at_most"] < 0.02
    assert "The fit has seen 'seen'" in err


def test_a_fit_of_hold_out_photos_alone_is_refused(photos, tmp_path, capsys):
    file = captures(tmp_path, SEEN | {"hold_out": True})
    status, report, _ = fit(capsys, tmp_path, photos, file)
    assert status == 2
    assert any("every photo is held out" in item["cause"] for item in report["problems"])


def test_a_fit_begins_where_another_one_ended(photos, tmp_path, capsys):
    file = captures(tmp_path, SEEN)
    _, first, _ = fit(capsys, tmp_path, photos, file)
    colour = first["parameters"]["Body:base_color"]["value"]
    saved = tmp_path / "saved.blend"
    status, second, err = command(
        capsys, "fit", photos, "--start", first["folder"], "--fit=Body:base_color,roughness",
        "--start=Body:roughness=0.4", "--height=16", "--iterations=1", "--search=off",
        f"--out={tmp_path / 'fits'}", "--save", str(saved),
    )  # fmt: skip
    assert status == 0, err
    rows = second["parameters"]
    assert rows["Body:base_color"]["initial"] == pytest.approx(colour)
    assert rows["Body:roughness"]["initial"] == pytest.approx(0.4)
    assert list(second["captures"]) == ["seen"]  # the photos of the first one
    # A value that is not fitted any more stays as it was found, in the scene that is saved too.
    status, third, err = command(
        capsys, "fit", photos, "--start", first["folder"], "--fit=Body:roughness",
        "--height=16", "--iterations=1", "--search=off", f"--out={tmp_path / 'fits'}",
        "--save", str(saved),
    )  # fmt: skip
    assert status == 0, err
    _, seen, _ = command(capsys, "check", str(saved))
    kept = seen["owners"]["Body"]["parameters"]["base_color"]["value"]
    assert kept == pytest.approx(colour, rel=1e-5)
    # Its record begins there again.
    record = str(Path(third["folder"]) / "run.json")
    status, fourth, err = command(capsys, "fit", record, f"--out={tmp_path / 'fits'}")
    assert status == 0, err
    assert fourth["parameters"] == third["parameters"]


def test_a_start_that_is_no_fit_is_refused(photos, tmp_path, capsys):
    status, report, _ = fit(
        capsys, tmp_path, photos, captures(tmp_path, SEEN), "--start", str(tmp_path)
    )
    assert status == 2
    assert "it holds no result.json" in report["problems"][0]["cause"]


def test_noise_of_renders_is_no_error():
    """Photo 1, renders 1 +- 0.1: the error is 0 within the limit, not 0.1; of an offset it is
    that."""
    draw = np.random.default_rng(3)
    photo, weight = np.ones((40, 50, 3)), np.ones((40, 50, 1))
    limits = []
    for offset in (0.0, 0.05):
        halves = [photo + offset + draw.normal(0, 0.1, photo.shape) for _ in range(2)]
        found = squared_error(halves, photo, weight).as_json()
        limits.append(found)
    assert limits[0]["relative_error"] is None and limits[0]["at_most"] < 0.02
    assert limits[1]["relative_error"] == pytest.approx(0.05, abs=0.005)


def test_the_panel_holds_a_photo_out(photos, tmp_path):
    import bpy

    scene = bpy.context.scene
    row = scene.selenite.captures.add()
    row.camera = bpy.data.objects["Camera"]
    row.photo = bpy.data.images.load(str(tmp_path / "seen.exr"))
    assert not captures_of(scene)[0].hold_out
    row.how.hold_out = True
    assert captures_of(scene)[0].hold_out


def test_more_samples_join_those_before(photos, tmp_path, capsys):
    file = captures(tmp_path, SEEN, UNSEEN | {"hold_out": True})
    status, report, err = fit(capsys, tmp_path, photos, file)
    assert status == 0, err
    seen = []

    def wants_more(found, samples):
        assert found.rows[0].spp == samples
        seen.append(found.rows[0])
        return samples < 256

    args = build_parser().parse_args(["compare", report["folder"], "--spp", "64"])
    found, _ = compared(args, wants_more)
    assert [row.spp for row in seen] == [64, 128, 256] and found.rows[0] is seen[-1]
    first, second, last = (np.subtract(*row.halves).var() for row in seen)
    # The difference of halves is noise alone: a quarter of it is left of four times the samples.
    assert last / first == pytest.approx(0.25, rel=0.15)
    # The new samples have noise of their own.
    new = np.subtract(
        *(2 * two - one for one, two in zip(*(r.halves for r in seen[:2]), strict=True))
    )
    old = np.subtract(*seen[0].halves)
    assert abs(np.corrcoef(new.ravel(), old.ravel())[0, 1]) < 0.15
    assert second < first
