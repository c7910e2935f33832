# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders that cannot be written and disks that are full: told before a fit where that can be
known; a fit that runs goes on, and its values come out."""

import errno
import json
import os
import resource
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy
import made_scenes as made
import pytest
from command_line import command
from pressed_buttons import TIMER, Pressed

from selenite import native
from selenite.atomic_files import partial_name
from selenite.fit import checkpoint
from selenite.report import results

pytestmark = pytest.mark.blender

ROOT = Path(__file__).resolve().parent.parent
COLOUR = (0.2, 0.6, 0.4)
NOT_UTF8 = os.fsdecode(b"caf\xe9")


@pytest.fixture
def words(lit_ball, tmp_path, capsys):
    """Arguments of a fit of the ball's colour, which starts elsewhere."""
    photo = tmp_path / "photo.exr"
    status, _, said = command(capsys, "render", lit_ball, f"--out={photo}", "--spp=64")
    assert status == 0, said
    return [
        "fit", lit_ball, f"--photo=Camera={photo}", "--fit=Body:base_color", "--height=16",
        "--start=Body:base_color=.5", "--iterations=12", "--picture-spp=8", "--search=off",
    ]  # fmt: skip


def files(folder):
    return sorted(item.relative_to(folder).as_posix() for item in folder.rglob("*"))


def full(*_arguments):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ("out", "text"),
    [
        ("photo.exr", "it is a file"),
        ("photo.exr/x", "is not a folder"),
        ("loop/x", "is not a folder"),
        ("x" * 300, "its name is too long"),
        ("/proc/nothing", "it cannot be written"),
    ],
)
def test_a_folder_that_cannot_be_used_is_told_before_the_fit(words, tmp_path, capsys, out, text):
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    before = files(tmp_path)
    status, report, said = command(capsys, *words, f"--out={tmp_path / out}")
    assert status == 2, said
    (problem,) = report["problems"]
    assert problem["object"] == f"Folder '{tmp_path / out}'"
    assert text in problem["cause"] and problem["cure"]
    assert files(tmp_path) == before


def test_a_disk_with_too_little_room_is_told_before_the_fit(words, tmp_path, capsys, monkeypatch):
    usage = checkpoint.shutil.disk_usage(tmp_path)
    monkeypatch.setattr("shutil.disk_usage", lambda _path: usage._replace(free=1000))
    before = files(tmp_path)
    status, report, _ = command(capsys, *words, f"--out={tmp_path / 'fits'}")
    assert status == 2
    assert "the disk has 1 kB left" in report["problems"][0]["cause"]
    assert files(tmp_path) == before


def test_a_record_that_cannot_be_written_ends_no_fit(words, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(checkpoint, "write_json", full)
    status, report, said = command(capsys, *words, f"--out={tmp_path / 'fits'}")
    assert status == 0, said
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    (warning,) = [text for text in report["warnings"] if "is not kept" in text]
    assert "No space left" in warning and "make room" in warning
    assert warning in said
    assert [item.name for item in (tmp_path / "fits").iterdir()] == [Path(report["folder"]).name]
    log = (Path(report["folder"]) / "result.json").read_text(encoding="utf-8")
    assert warning in json.loads(log)["warnings"]


class Job:
    """A fit; its whole state is there at once when it is asked for, as if that took `seconds`."""

    def __init__(self, seconds=0.0):
        self.written, self.seconds, self.asked = None, seconds, 0

    def progress_or_failure(self):
        return SimpleNamespace(running=True, iteration=7, seconds=1.5)

    def request_state(self, file):
        file.write_bytes(b"state")
        self.written = SimpleNamespace(file=file, seconds=self.seconds)
        self.asked += 1

    def take_state(self):
        taken, self.written = self.written, None
        return taken


def test_the_record_is_written_once_there_is_room(tmp_path, monkeypatch):
    from test_resume import plan_of

    plan, job = plan_of(tmp_path), Job()
    recorder = checkpoint.Recorder(tmp_path / "run", plan.request)
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "write_json", full)
        patch.setattr(checkpoint, "keep", full)
        recorder.update(job, now=True)  # asks for the first
        recorder.update(job, now=True)
        assert "No space left" in recorder.trouble
    recorder.update(job, now=True)
    assert recorder.trouble == ""
    assert len(recorder.notes()) == 1
    run = checkpoint.load(tmp_path / "run")
    assert (run.state.file.read_bytes(), run.state.seconds) == (b"state", 1.5)
    assert not list((tmp_path / "run").glob("*.partial")), "the one that found no room"


def test_states_that_take_long_are_seldom_written(tmp_path, monkeypatch):
    from test_resume import plan_of

    plan, now = plan_of(tmp_path), 0.0
    monkeypatch.setattr(checkpoint, "time", SimpleNamespace(monotonic=lambda: now))
    asked = {}
    for seconds in (0.0, 10.0):
        now, job = 0.0, Job(seconds)
        recorder = checkpoint.Recorder(tmp_path / f"run{seconds}", plan.request)
        while now < 601:
            recorder.update(job)
            now += 1
        asked[seconds] = job.asked
    # every 15 s and those that an update takes to see it; every 300 s
    assert 30 <= asked[0.0] <= 41
    assert asked[10.0] == 2


def test_states_that_a_killed_process_left_go(tmp_path):
    from test_resume import plan_of

    plan, job = plan_of(tmp_path), Job()
    recorder = checkpoint.Recorder(tmp_path / "run", plan.request)
    left = partial_name(tmp_path / "run" / "state.json")
    left.write_bytes(b"sta")
    recorder.update(job, now=True)  # asks for the first
    recorder.update(job, now=True)
    assert not left.exists()
    assert checkpoint.load(tmp_path / "run").state.file.read_bytes() == b"state"


def test_on_a_full_disk_the_values_come_out(words, tmp_path):
    """No file of the process may be larger than 2 kB: the record and the results need more."""

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    done = subprocess.run(
        [sys.executable, "-m", "selenite", *words, f"--out={tmp_path / 'fits'}", "--json"],
        env=os.environ | {"PYTHONPATH": str(ROOT / "addon"), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True, timeout=300, check=False, preexec_fn=limited,
    )  # fmt: skip
    said = done.stderr.decode()
    assert done.returncode == 1, said
    report = json.loads(done.stdout)
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert report["folder"] is None
    assert "the results cannot be written" in report["error"]
    assert "Body:base_color" in said and "determined" in said and "is not kept in" in said
    assert "Traceback" not in said
    left = {name.rpartition("/")[2] for name in files(tmp_path / "fits")}
    assert not {name for name in left if name.endswith((".partial", ".part"))}, left


def limited_run(words, most, **streams):
    """A command none of whose files may be larger than `most` bytes."""

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))

    return subprocess.run(
        [sys.executable, "-m", "selenite", *words],
        env=os.environ | {"PYTHONPATH": str(ROOT / "addon"), "PYTHONDONTWRITEBYTECODE": "1"},
        timeout=300, check=False, preexec_fn=limited, stderr=subprocess.PIPE, **streams,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_picture_that_the_disk_cuts_is_no_picture(lit_ball, tmp_path, name):
    """Encoders write what they can and say nothing: the file was there, cut, with status 0."""
    words = ["render", lit_ball, f"--out={tmp_path / name}", "--spp=1", "--width=64", "--height=64"]
    done = limited_run(words, 2000)
    assert done.returncode == 1, done.stderr
    assert f"'{tmp_path / name}' cannot be written: File too large" in done.stderr.decode()
    assert not [item for item in files(tmp_path) if "a." in item or "selenite-" in item]


def test_a_scene_that_the_disk_cuts_is_reported(words, tmp_path):
    """Beside values that come out: the result folder is small enough."""
    save = tmp_path / "fitted.blend"
    done = limited_run([*words, f"--out={tmp_path / 'fits'}", f"--save={save}", "--json"],
                       100_000, stdout=subprocess.PIPE)  # fmt: skip
    assert done.returncode == 1, done.stderr
    report = json.loads(done.stdout)
    assert f"File '{save}': cannot be written" in report["error"]
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert not save.exists() and not (tmp_path / "fitted.blend@").exists()


def test_a_blend_is_whole_if_it_ends_as_one(tmp_path):
    """Compressed or not."""
    from selenite.problems import NotWritten
    from selenite.scene_read.blend_file import whole_blend

    for compress in (False, True):
        path = tmp_path / f"scene{compress}.blend"
        with whole_blend(str(path), "give another"):
            bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, compress=compress)
        content = path.read_bytes()
        with (
            pytest.raises(NotWritten, match="in part only"),
            whole_blend(str(path), "give another"),
        ):
            path.write_bytes(content[:-400])


def test_names_may_be_as_long_as_a_file_system_permits(lit_ball, tmp_path, capsys):
    for ending in (".png", ".exr"):
        out = tmp_path / ("n" * (255 - len(ending)) + ending)
        words = ["--spp=1", "--width=8", "--height=8"]
        status, _, said = command(capsys, "render", lit_ball, f"--out={out}", *words)
        assert status == 0 and out.exists(), said


@pytest.mark.parametrize(
    ("words", "status"),
    [(["--json"], 1), ([], 0)],
    ids=["the object has nowhere to go", "nobody asked for it"],
)
def test_a_stdout_that_is_closed_costs_its_object_alone(lit_ball, words, status):
    """And no file gets its number, into which Blender would print."""
    shell = f"exec '{sys.executable}' -m selenite check '{lit_ball}' {' '.join(words)} >&-"
    done = subprocess.run(
        ["bash", "-c", shell],
        env=os.environ | {"PYTHONPATH": str(ROOT / "addon")},
        capture_output=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stderr
    assert (b"stdout is closed" in done.stderr) == bool(status)
    assert b"internal error" not in done.stderr


@pytest.mark.parametrize("words", [["--help"], ["fit", "--help"], ["--version"]])
def test_help_that_nobody_can_read_is_a_failure(words):
    with Path("/dev/full").open("wb") as full_disk:
        done = limited_run(words, 1 << 30, stdout=full_disk)
    assert done.returncode == 1 and b"the text cannot be written" in done.stderr


def test_a_saved_scene_and_a_check_that_fail_cost_no_values(words, tmp_path, capsys, monkeypatch):
    from selenite import write_back
    from selenite.problems import BadInput, Problem
    from selenite.scene_read import blender_process

    def refuse(path):
        raise BadInput(Problem(f"File '{path}'", "cannot be written (disk full)", "give another"))

    monkeypatch.setattr(write_back, "save_copy", refuse)
    monkeypatch.setattr(blender_process, "blender_words", lambda worker: [str(tmp_path / "gone")])
    out, save = tmp_path / "fits", tmp_path / "fitted.blend"
    status, report, said = command(
        capsys, *words, f"--out={out}", f"--save={save}", "--check-in-cycles"
    )
    assert status == 1
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert Path(report["folder"]).is_dir()
    assert f"File '{save}': cannot be written (disk full); give another" in report["error"]
    assert "The check in Cycles failed" in report["error"]
    assert "saved" not in report and "Traceback" not in said


def test_a_fit_that_never_began_leaves_no_folder(words, tmp_path, capsys, monkeypatch):
    from selenite.commands import fit
    from selenite.fit.job import FitFailed
    from selenite.problems import Problem

    class Failing:
        def __init__(self, job):
            self.job = job

        def __getattr__(self, name):
            return getattr(self.job, name)

        def start(self):
            """It ends before its first iteration."""

        def progress(self):
            raise FitFailed([Problem("Photo 'Camera'", "it is odd", "give another")])

    made_job = fit.FitJob
    monkeypatch.setattr(fit, "FitJob", lambda *given, **more: Failing(made_job(*given, **more)))
    status, report, _ = command(capsys, *words, f"--out={tmp_path / 'fits'}")
    assert status == 2
    (problem,) = report["problems"]
    assert problem == {"object": "Photo 'Camera'", "cause": "it is odd", "cure": "give another"}
    assert list((tmp_path / "fits").iterdir()) == []


def test_names_that_are_not_utf8_go_through(words, tmp_path, capsys):
    folder = tmp_path / NOT_UTF8
    folder.mkdir()
    scene, photo = folder / f"{NOT_UTF8}.blend", folder / f"{NOT_UTF8}.exr"
    Path(words[1]).rename(scene)
    (tmp_path / "photo.exr").rename(photo)
    mask = made.photo(folder / f"{NOT_UTF8} mask.png", value=1.0)
    given = [word for word in words[2:] if not word.startswith("--photo")]
    status, report, said = command(
        capsys, "fit", str(scene), *given, f"--photo=Camera={photo}", f"--mask=Camera={mask}",
        f"--out={folder / 'fits'}", f"--save={folder / 'out.blend'}",
    )  # fmt: skip
    assert status == 0, said
    assert report["folder"].startswith(str(folder))
    assert report["parameters"]["Body:base_color"]["value"] == pytest.approx(COLOUR, abs=0.03)
    assert (folder / "out.blend").is_file()
    run = Path(report["folder"]) / "run.json"
    json.loads(run.read_bytes().decode("utf-8"))
    status, again, said = command(capsys, "fit", str(run), f"--out={folder / 'fits'}")
    assert status == 0, said
    assert again["parameters"] == report["parameters"]


def test_names_that_become_the_same_file_do_not(tmp_path, capsys):
    made.sphere(material=made.material())
    made.world()
    names = ["a/b", "a_b", "a b", "A_B"]
    for name in names:
        made.camera(name)
    scene = made.save(tmp_path / "scene.blend")
    photos = []
    for index, name in enumerate(names):
        path = made.photo(tmp_path / f"{index}.png", value=0.1 * (1 + index))
        photos.append(f"--photo={name}={path}")
    status, report, said = command(
        capsys, "fit", scene, *photos, "--fit=Body:roughness", "--height=12", "--iterations=2",
        "--search=off", "--picture-spp=1", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    assert status == 0, said
    stems = report["pictures"]
    assert len({stem.casefold() for stem in stems.values()}) == 4
    assert stems["a_b"] == "a_b"
    read = native.image().read
    for index, name in enumerate(names):
        picture = read(f"{report['folder']}/{stems[name]}_reference.exr")[0]
        assert picture.mean() == pytest.approx(0.1 * (1 + index), abs=0.01), name


@pytest.mark.usefixtures("addon")
def test_the_panel_keeps_the_result_and_tells_of_the_record(tmp_path, monkeypatch):
    from test_interface import draw, prepare_fit

    from selenite.interface import panels, state
    from selenite.interface.operators.fit import SELENITE_OT_start as Start

    _, settings = prepare_fit(tmp_path, lasting=True)
    settings.output = str(tmp_path / "fits")
    start = Pressed(Start)
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "write_json", full)
        assert start._start(bpy.context)
        assert any("No space left" in text for _, text in start.said)
        said = len(start.said)
        for _ in range(3):
            assert start.modal(bpy.context, TIMER) == {"PASS_THROUGH"}
        assert len(start.said) == said  # told once
        drawn = " ".join(draw(panels.SELENITE_PT_fit).split())
        assert "is not kept" in drawn
        bpy.ops.selenite.stop()
        state.RUN.fitting.job.join()
        assert start._finish(bpy.context) == {"FINISHED"}
    assert any("is not kept" in note for note in state.RUN.done.result.notes)
    assert len(settings.results) == 1
    with monkeypatch.context() as patch:
        patch.setattr(results, "write_json", full)
        with pytest.raises(RuntimeError, match="Cannot write to .* choose another folder"):
            bpy.ops.selenite.save_result()
    assert state.RUN.done is not None
    assert bpy.ops.selenite.save_result() == {"FINISHED"}
