# SPDX-License-Identifier: GPL-3.0-or-later
"""Every option of `selenite fit` reaches the native fit, at values that no default has."""

import json
from pathlib import Path

import made_scenes as made
import numpy as np
import pytest
import recording_fit
from command_line import command

from selenite import native

pytestmark = pytest.mark.blender

SETTINGS = {
    "loss": "mse",
    "optimiser": "adam",
    "iterations": 7,
    "most_iterations": 0,
    "spp": 6,
    "tolerance": 0.25,
    "seed": 11,
    "depth": 5,
    "threads": 2,
    "accumulate": False,
    "search": "on",
    "precision": 0.0,
    "prior": "misfit",
}
WORDS = (
    "--loss=mse", "--optimiser=adam", "--iterations=7", "--spp=6", "--tolerance=0.25", "--seed=11",
    "--depth=5", "--threads=2", "--no-accumulate", "--search=on", "--height=18",
    "--learning-rate=0.07", "--picture-spp=3", "--physical-refraction", "--precision=exact",
    "--prior=misfit",
)  # fmt: skip
# Name -> start and bounds, and what native.Fit is asked for.
UNKNOWNS = {
    "Body:base_color": ((0.3, 0.5, 0.7), (0.1, 0.9)),
    "Body:roughness": ((0.45,), (0.2, 0.6)),
    "Key Light:power": ((55.0,), (20.0, 90.0)),
}


@pytest.fixture
def scene(tmp_path):
    """A ball, a lamp and two cameras, with a photo of 48 x 36 pixels of each in other greys."""
    made.studio(base_color=(0.8, 0.4, 0.2), roughness=0.5)
    made.light("Key Light", energy=40)
    made.camera("Side", distance=4.0)
    for name, value in (("Camera", 0.25), ("Side", 0.5)):
        made.photo(tmp_path / f"{name}.exr", size=(48, 36), value=value)
    left = np.zeros((36, 48, 3), np.float32)
    left[:, :24] = 1
    native.image().write_png(str(tmp_path / "left.png"), left)
    return made.save(tmp_path / "scene.blend")


def words(scene, folder, *more):
    """A fit of UNKNOWNS to both photos, the second one with a mask."""
    found = ["fit", scene, f"--out={folder / 'fits'}"]
    found += [f"--photo={name}={folder / name}.exr" for name in ("Camera", "Side")]
    found += [f"--mask=Side={folder / 'left.png'}"]
    for name, (start, bounds) in UNKNOWNS.items():
        found += [f"--fit={name}", f"--start={name}={','.join(map(str, start))}"]
        found += [f"--bounds={name}={','.join(map(str, bounds))}"]
    return [*found, *more]


def expected_unknowns(rate):
    return [
        (*name.split(":"), list(start), low, high, rate)
        for name, (start, (low, high)) in UNKNOWNS.items()
    ]


def unknowns_of(fit):
    return [
        (item.owner, item.parameter, item.start, item.minimum, item.maximum, item.learning_rate)
        for item in fit.unknowns
    ]


def assert_as_asked(fit):
    """The arguments of a native fit of `words` with WORDS."""
    assert fit.settings == SETTINGS
    assert unknowns_of(fit) == expected_unknowns(0.07)
    starts = {name: list(start) for name, (start, _) in UNKNOWNS.items()}
    found = recording_fit.values_of(fit.scene, UNKNOWNS)
    for name, start in starts.items():
        assert found[name] == pytest.approx(start)
    first, second = fit.photos
    assert (first.id, first.camera) == ("Camera", "Camera")
    assert (second.id, second.camera) == ("Side", "Side")
    for photo, value in ((first, 0.25), (second, 0.5)):
        assert photo.reference.shape == (18, 24, 3)
        assert photo.reference == pytest.approx(value)
        assert photo.frame == (pytest.approx(4 / 3), 48, 36)
    assert (first.weight == 1).all()
    # the rim of a mask, one pixel of the comparison, does not count
    assert (second.weight[:, :11] == 1).all() and (second.weight[:, 11:] == 0).all()


def test_every_option_reaches_the_native_fit(scene, tmp_path, capsys, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    status, report, printed = command(capsys, *words(scene, tmp_path, *WORDS))
    assert status == 0, printed
    assert_as_asked(recorded.fit)
    assert recorded.fit.calls[0] == "start" and "join" in recorded.fit.calls
    assert {item["physical_refraction"] for item in recorded.materials} == {True}
    assert report["seed"] == 11


def test_pictures_are_rendered_as_the_options_say(scene, tmp_path, capsys, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    status, report, printed = command(capsys, *words(scene, tmp_path, *WORDS))
    assert status == 0, printed
    cameras = [picture.camera for picture in recorded.pictures]
    assert cameras == ["Camera", "Camera", "Side", "Side"]
    for index, picture in enumerate(recorded.pictures):
        assert picture.size == (24, 18) and picture.spp == (3 if index % 2 else 1)
        assert (picture.seed, picture.depth, picture.threads) == (11, 5, 2)
        assert picture.frame == (pytest.approx(4 / 3), 48, 36)
        found = recording_fit.values_of(picture.scene, UNKNOWNS)
        wanted = recorded.fit.best if index % 2 else recorded.fit.start_values
        for name, value in wanted.items():
            assert found[name] == pytest.approx(value), (index, name)
    error = native.image().read(str(Path(report["folder"]) / "Side_error.exr"))[0]
    assert error[:, :11].max() > 0.01 and (error[:, 11:] == 0).all(), "masked"


def test_a_run_file_asks_for_the_same(scene, tmp_path, capsys, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    _, report, _ = command(capsys, *words(scene, tmp_path, *WORDS))
    run = Path(report["folder"]) / "run.json"
    status, again, printed = command(capsys, "fit", str(run), f"--out={tmp_path / 'fits'}")
    assert status == 0, printed
    assert_as_asked(recorded.fits[1])
    assert {item["physical_refraction"] for item in recorded.materials} == {True}
    assert {picture.spp for picture in recorded.pictures} == {1, 3}
    stored = [json.loads(path.read_text()) for path in (run, Path(again["folder"]) / "run.json")]
    assert stored[0] == stored[1]


@pytest.mark.parametrize(
    ("option", "key", "value"),
    [
        ("--loss=mae", "loss", "mae"),
        ("--optimiser=gauss-newton", "optimiser", "gauss-newton"),
        ("--search=off", "search", "off"),
        ("--prior=agreement", "prior", "agreement"),
        ("--accumulate", "accumulate", True),
        ("--seed=12", "seed", 12),
        ("--depth=0", "depth", 0),
        ("--tolerance=0", "tolerance", 0.0),
        ("--threads=1", "threads", 1),
    ],
)
def test_an_option_replaces_what_the_run_file_says(
    scene, tmp_path, capsys, monkeypatch, option, key, value
):
    """Zeros and False too, which are given although they look like nothing."""
    recorded = recording_fit.install(monkeypatch)
    _, report, _ = command(capsys, *words(scene, tmp_path, *WORDS))
    run = str(Path(report["folder"]) / "run.json")
    status, _, printed = command(capsys, "fit", run, option, f"--out={tmp_path / 'fits'}")
    assert status == 0, printed
    assert recorded.fits[1].settings == SETTINGS | {key: value}


@pytest.mark.parametrize(
    ("option", "wanted"),
    [
        ("--preset=draft", {"iterations": 25, "spp": 4, "tolerance": 0.0}),
        ("--preset=accurate", {"iterations": 60, "spp": 16, "tolerance": 0.0}),
        ("--optimiser=adam", {"iterations": 100, "spp": 4, "tolerance": 0.001}),
        ("--seed=1", {"iterations": 40, "spp": 4, "tolerance": 0.0}),
    ],
)
def test_presets_are_what_the_guide_says(scene, tmp_path, capsys, monkeypatch, option, wanted):
    recorded = recording_fit.install(monkeypatch)
    status, _, printed = command(capsys, *words(scene, tmp_path, option, "--picture-spp=2"))
    assert status == 0, printed
    assert {key: recorded.fit.settings[key] for key in wanted} == wanted
    assert unknowns_of(recorded.fit) == expected_unknowns(0.03)


def test_stages_have_settings_and_pictures_of_their_own(scene, tmp_path, capsys, monkeypatch):
    recorded = recording_fit.install(monkeypatch)
    stages = tmp_path / "stages.json"
    colour, rest = "Body:base_color", ["Body:base_color", "Body:roughness", "Key Light:power"]
    entries = [
        {"name": "colour", "parameters": [colour], "iterations": 9, "spp": 8, "height": 12},
        {"name": "rest", "parameters": rest},
    ]
    stages.write_text(json.dumps({"schema": 1, "stages": entries}))
    status, report, printed = command(capsys, *words(scene, tmp_path, *WORDS, f"--stages={stages}"))
    assert status == 0, printed
    first, second = recorded.fit.stages
    assert first.settings == SETTINGS | {"iterations": 9, "spp": 8}
    assert second.settings == SETTINGS | {"seed": 11 + (1 << 32)}
    assert (first.parameters, second.parameters) == ([colour], rest)
    assert {photo.reference.shape for photo in first.photos} == {(12, 16, 3)}
    assert {photo.reference.shape for photo in second.photos} == {(18, 24, 3)}
    assert unknowns_of(recorded.fit) == expected_unknowns(0.07)
    assert [stage["name"] for stage in report["stages"]] == ["colour", "rest"]
    assert report["parameters"][colour]["value"] == pytest.approx(recorded.fit.best[colour])
