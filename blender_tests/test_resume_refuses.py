# SPDX-License-Identifier: GPL-3.0-or-later
"""What a run that was interrupted does not go on with: other inputs, a damaged state."""

import json
from types import SimpleNamespace

import made_scenes as made
import numpy as np
import pytest
from command_line import command
from test_resume import finished, plan_of

from selenite.commands import fit
from selenite.fit import checkpoint
from selenite.fit.job import FitJob, SavedState
from selenite.fit.plan import prepare
from selenite.problems import BadInput

pytestmark = pytest.mark.blender


@pytest.mark.parametrize("changed", ["photo", "mask", "grid", "scene", "texture"])
def test_a_run_whose_input_has_changed_is_refused_by_name(changed, tmp_path, capsys):
    """Killed before its first iteration, so that nothing but the folder tells of it."""
    made.smoke()
    painted = made.material("Paint")
    made.photo(tmp_path / "paint.png", size=(4, 4), value=0.3)
    node = painted.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = made.bpy.data.images.load(str(tmp_path / "paint.png"))
    made.link(painted, node.outputs["Color"])
    made.triangle("Floor", painted).location = (0, 0, -2)
    scene = made.save(tmp_path / "scene.blend")
    made.photo(tmp_path / "photo.exr", value=0.3)
    made.photo(tmp_path / "mask.png", value=1.0)
    np.save(tmp_path / "start.npy", np.full((2, 2, 2, 3), 0.5, np.float32))
    words = (
        "fit", scene, f"--photo=Camera={tmp_path / 'photo.exr'}", "--height=12", "--iterations=2",
        f"--mask=Camera={tmp_path / 'mask.png'}", "--fit=Smoke:albedo_grid", "--picture-spp=1",
        f"--grid=Smoke:albedo_grid={tmp_path / 'start.npy'}", f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        # As if it ended before its results.
        patch.setattr(fit, "deliver", lambda *_: SimpleNamespace(as_json=dict))
        assert command(capsys, *words)[0] == 0
    (folder,) = (tmp_path / "fits").iterdir()
    (folder / "state.json").unlink()
    names = {
        "photo": f"Photo '{tmp_path / 'photo.exr'}'",
        "mask": f"Mask '{tmp_path / 'mask.png'}'",
        "grid": f"File '{tmp_path / 'start.npy'}'",
        "scene": f"Scene '{scene}'",
        "texture": f"Scene '{scene}'",
    }
    if changed == "photo":
        made.photo(tmp_path / "photo.exr", value=0.31)
    elif changed == "mask":
        made.photo(tmp_path / "mask.png", value=0.99)
    elif changed == "grid":
        np.save(tmp_path / "start.npy", np.full((2, 2, 2, 3), 0.51, np.float32))
    elif changed == "texture":
        made.photo(tmp_path / "paint.png", size=(4, 4), value=0.4)
    else:
        made.bpy.ops.wm.open_mainfile(filepath=scene, load_ui=False)
        made.bpy.data.lights["Key"].energy *= 1.5
        made.save(scene)
    status, report, _ = command(capsys, "fit", "--resume", str(folder))
    assert status == 2
    (problem,) = report["problems"]
    assert problem["object"] == names[changed]
    assert "changed since the run began" in problem["cause"]
    assert "put back what was there" in problem["cure"]
    assert folder.is_dir()


def test_a_run_goes_on_where_its_scene_was_only_moved_and_saved_again(lit_ball, tmp_path, capsys):
    photo = made.photo(tmp_path / "photo.exr", value=0.3)
    words = (
        "fit", lit_ball, f"--photo=Camera={photo}", "--fit=Body:base_color", "--height=16",
        f"--out={tmp_path / 'fits'}",
    )  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit, "deliver", lambda *_: SimpleNamespace(as_json=dict))
        assert command(capsys, *words, "--iterations=3")[0] == 0
    (folder,) = (tmp_path / "fits").iterdir()
    made.bpy.ops.wm.open_mainfile(filepath=words[1], load_ui=False)
    made.bpy.data.texts.new("a note")
    moved = made.save(tmp_path / "moved.blend")
    status, report, _ = command(capsys, "fit", moved, "--resume", str(folder))
    assert status == 0, report
    assert not folder.exists()


DAMAGE = {
    "nothing": b"",
    "no JSON": b"{",
    "a list": b"[]",
    "deep": b"[" * 100_000,
    "another schema": b'{"schema": 99}',
    "no file": b'{"schema": 2, "seconds": 1}',
    "a file elsewhere": b'{"schema": 2, "file": "../photo.png", "seconds": 1}',
    "no time": b'{"schema": 2, "file": "run.json", "seconds": "soon"}',
    "stages of an earlier version": b'{"schema": 1, "grids": null, "parts": []}',
}


@pytest.mark.parametrize("name", DAMAGE)
def test_a_damaged_state_is_refused(name, tmp_path):
    plan = plan_of(tmp_path)
    checkpoint.Recorder(tmp_path / "run", plan.request)
    (tmp_path / "run" / "state.json").write_bytes(DAMAGE[name])
    with pytest.raises(BadInput, match="its state cannot be read"):
        checkpoint.load(tmp_path / "run")


def test_a_state_in_which_anything_is_missing_or_wrong_is_refused(tmp_path):
    """Each entry of state.json taken out, and put there as something else: a problem, or a run that
    goes on; never another exception."""
    plan = plan_of(tmp_path)
    recorder = checkpoint.Recorder(tmp_path / "run", plan.request)
    recorder.update(finished(plan), now=True)
    path = tmp_path / "run" / "state.json"
    state = json.loads(path.read_text(encoding="utf-8"))
    refused = tried = 0
    for place in places(state):
        for value in (None, "x", [], {}, -1, 1e300, [[None]]):
            path.write_text(json.dumps(replaced(state, place, value)), encoding="utf-8")
            tried += 1
            try:
                run = checkpoint.load(tmp_path / "run")
                job = FitJob(plan_at(plan, run), run.state)
                job.so_far()
            except BadInput:
                refused += 1
    assert tried > 30 and refused > tried / 2, (tried, refused)


def test_a_state_that_has_gone_is_refused_by_its_file(tmp_path):
    state = SavedState(tmp_path / "fit_1.state", 1.0)
    with pytest.raises(BadInput, match="No such file") as found:
        FitJob(plan_of(tmp_path), state)
    assert found.value.problems[0].object == f"File '{state.file}'"


def plan_at(plan, run):
    """The plan of another request for the same scene and photos."""
    return prepare(made.read(), run.request) if run.request != plan.request else plan


def places(value, path=()):
    """Paths of all entries of lists and dicts, of long lists the first only."""
    items = value.items() if isinstance(value, dict) else enumerate(value[:1])
    for key, item in items:
        yield (*path, key)
        if isinstance(item, (dict, list)):
            yield from places(item, (*path, key))


def replaced(value, path, new):
    """A copy with another entry at `path`."""
    copy = json.loads(json.dumps(value))
    inside = copy
    for key in path[:-1]:
        inside = inside[key]
    inside[path[-1]] = new
    return copy
