# SPDX-License-Identifier: GPL-3.0-or-later
"""What a real fit says about itself: in result.json, log.txt, the terminal and the panel."""

from pathlib import Path
from types import SimpleNamespace

import bpy
import made_scenes as made
import numpy as np
import pytest
from command_line import command
from pressed_buttons import Pressed
from test_interface import draw, prepare_fit

from selenite import native
from selenite.cli import main
from selenite.interface import panels, state

pytestmark = pytest.mark.blender


def fit(tmp_path, capsys, *words, parameter="base_color", gain=1.0, shift=0.0):
    """The warnings of result.json of a fit to a photo of colour .2, .6, .4 that was changed."""
    start = (0.8, 0.4, 0.2) if parameter == "base_color" else (0.2, 0.6, 0.4)
    made.studio(base_color=start, roughness=0.5)
    made.light("Key Light", energy=200)
    made.world(color=(0.05, 0.05, 0.05))
    camera = bpy.data.objects["Camera"].data
    camera.shift_x = -shift / 32  # of the picture's width: the ball moves to the right
    path = made.save(tmp_path / "photo.blend")
    photo = str(tmp_path / "photo.exr")
    set_colour = ("--set", "Body:base_color=.2,.6,.4", "--spp", "256")
    assert main(["render", path, "--out", photo, *set_colour]) == 0
    native.image().write_exr(photo, native.image().read(photo)[0] * np.float32(gain))
    bpy.data.objects["Camera"].data.shift_x = 0
    path = made.save(tmp_path / "scene.blend")
    base = (f"--fit=Body:{parameter}", "--iterations=20", "--height=24", "--spp=8")
    out = f"--out={tmp_path / 'fits'}"
    status, report, printed = command(
        capsys, "fit", path, f"--photo=Camera={photo}", *base, out, *words
    )
    assert status == 0, printed
    log = (Path(report["folder"]) / "log.txt").read_text(encoding="utf-8")
    for text in report["warnings"]:
        assert f"Warning: {text}" in log
        # The terminal tells it when it begins, with the numbers of that iteration.
        lines = without_digits(printed).splitlines()
        assert f"warning: {without_digits(text)}" in lines
    return report["warnings"]


def without_digits(text):
    return "".join(c for c in text if not c.isdigit())


def test_a_fit_that_goes_well_says_nothing(tmp_path, capsys):
    assert fit(tmp_path, capsys) == []


def test_a_bound_that_is_too_narrow(tmp_path, capsys):
    notes = fit(tmp_path, capsys, "--bounds=Body:base_color=.3,.9")
    (note,) = [text for text in notes if "minimum" in text]
    assert note.startswith("Body:base_color.r has sat at its minimum 0.3 for "), notes


def test_a_photo_of_twice_the_exposure(tmp_path, capsys):
    notes = fit(tmp_path, capsys, parameter="diffuse_roughness", gain=2.0)
    (note,) = [text for text in notes if "times" in text]
    assert "brightness-independent-mse" in note, notes


def test_a_camera_that_is_two_pixels_off(tmp_path, capsys):
    notes = fit(tmp_path, capsys, shift=2.0)
    (note,) = [text for text in notes if "silhouette" in text]
    assert "pixels to the right" in note and "seen through" not in note, notes


def test_where_a_material_may_transmit_its_refraction_may_be_wrong(tmp_path, capsys):
    notes = fit(tmp_path, capsys, "--fit=Body:transmission", shift=2.0)
    (note,) = [text for text in notes if "silhouette" in text]
    assert "or what is seen through the body is not right yet" in note, notes


@pytest.mark.usefixtures("addon")
def test_the_panel_shows_it_while_the_fit_runs_and_afterwards(tmp_path):
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path, iterations=60)
    row = next(item for item in settings.rows if item.parameter == "base_color")
    row.minimum, row.use_start, row.start = 0.7, True, (0.9, 0.9, 0.9)
    start = Pressed(Start)
    assert start._start(bpy.context)
    fitting = state.RUN.fitting
    fitting.job.join()
    assert start._finish(bpy.context) == {"FINISHED"}
    drawn = " ".join(draw(panels.SELENITE_PT_fit).split())
    assert "has sat at its minimum 0.7" in drawn
    notes = state.RUN.done.result.notes
    state.RUN.phase = fitting
    fitting.job = SimpleNamespace(newest_notes=notes, stage_title=lambda _progress: "")
    fitting.progress = SimpleNamespace(
        iteration=9, iterations=60, loss=0.1, values={}, phase="descent"
    )
    try:
        assert "has sat at its minimum 0.7" in " ".join(draw(panels.SELENITE_PT_fit).split())
    finally:
        state.RUN.phase = None


@pytest.mark.parametrize(("transmission", "said"), [(0.0, 1), (0.5, 0)])
def test_light_where_an_opaque_body_is_dark(tmp_path, capsys, transmission, said):
    made.studio(base_color=(0.5, 0.5, 0.5), roughness=0.8, transmission=transmission)
    lamp = made.light("Key Light", energy=600)
    lamp.location = (4, 0, 0)  # half of the ball is dark
    made.world(color=(0.2, 0.2, 0.2))
    photo = tmp_path / "photo.exr"
    assert main(["render", made.save(tmp_path / "a.blend"), "--out", str(photo), "--spp=64"]) == 0
    made.world(strength=0)
    path = made.save(tmp_path / "scene.blend")
    status, report, printed = command(
        capsys, "fit", path, *[f"--photo=Camera={photo}"] * 3, "--fit=Body:base_color",
        "--silhouette=1", "--iterations=12", "--height=24", "--spp=8", "--search=off",
        "--picture-spp=1", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    assert status == 0, printed
    assert sum("leaves dark" in text for text in report["warnings"]) == said, report["warnings"]
