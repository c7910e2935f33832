# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command line says of wrong words, of failures and of its own faults. Without Blender."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "addon"))

from selenite import cli, native  # noqa: E402
from selenite.commands import probe, terminal  # noqa: E402
from selenite.commands.examples import EXAMPLES  # noqa: E402
from selenite.fit.request import read_run  # noqa: E402
from selenite.fit.staging.request import read_stages  # noqa: E402
from selenite.problems import BadInput, Failed, Problem, choice, refused  # noqa: E402


@pytest.mark.parametrize(
    ("words", "name", "cause"),
    [
        (["fit", "--spp=x"], "Argument --spp", "invalid int value: 'x'"),
        (["render", "s.blend", "--out=o.exr", "--spp=0"], "Argument --spp", "0 is less than 1"),
        (["render", "s.blend"], "Command line", "arguments are required: --out"),
        (["fit", "s.blend", "--preset=best"], "Argument --preset", "invalid choice: 'best'"),
        (["fit", "s.blend", "--nothing"], "Command line", "unrecognized arguments: --nothing"),
        (["paint"], "Argument COMMAND", "invalid choice: 'paint'"),
        ([], "Command line", "required: COMMAND"),
        (["fit", "--iterations", "9" * 5000], "Argument --iterations", "invalid int value"),
    ],
)
def test_wrong_words_are_problems_in_json_too(
    words: list[str], name: str, cause: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*words, "--json"]) == 2
    printed = capsys.readouterr()
    (problem,) = json.loads(printed.out)["problems"]
    assert problem["object"] == name
    assert cause in problem["cause"]
    assert "--help" in problem["cure"]
    assert f"{name}: " in printed.err and "Traceback" not in printed.err
    assert cli.main(words) == 2
    assert capsys.readouterr().out == ""


def test_a_problem_that_is_named_like_its_command_has_one_prefix(
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = [Problem("Fit", "there is no photo", "give one"), Problem("Camera 'A'", "lost", "go")]
    report = {"problems": [item.as_json() for item in found]}
    assert cli._report("fit", report, None) == 2
    said = capsys.readouterr().err.splitlines()
    assert said == ["Fit: there is no photo; give one", "fit: Camera 'A': lost; go"]


def commands() -> dict[str, argparse.ArgumentParser]:
    """The parser of each."""
    (action,) = [item for item in cli.build_parser()._actions if item.dest == "command"]
    return dict(action.choices or {})


def test_every_help_has_groups_and_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    said = capsys.readouterr().out
    assert "examples:\n" in said
    for name, parser in commands().items():
        assert f"  {name} " in said, "the program's help lists its commands"
        loose = [x.option_strings for x in parser._optionals._group_actions]
        assert loose == [["-h", "--help"], ["--json"]], "every other option is in a named group"
        assert cli.main([name, "--help"]) == 0
        text = capsys.readouterr().out
        assert f"selenite {name}" in text.partition("examples:\n")[2]
        for action in parser._actions:
            assert action.help or not action.option_strings, f"{name} {action.option_strings}"


def test_examples_are_commands_that_the_program_takes() -> None:
    for name, examples in EXAMPLES.items():
        assert examples
        for _, line in examples:
            if "--help" not in line:
                args = cli.build_parser().parse_args(line.split())
                assert name in ("", args.command)


#: Every command that opens a scene.
WITH_BLENDER = {
    "import": ["f.obj", "--save=o.blend"],
    "check": ["s.blend"],
    "render": ["s.blend", "--out=o.exr"],
    "gradient": ["s.blend", "--parameter=Body:ior"],
    "fit": ["s.blend", "--fit=Body:ior"],
    "batch": ["f.toml"],
    "compare": ["."],
    "next-camera": ["s.blend", "--fit=Body:ior"],
    "trade": ["s.blend", "--fit=Body:ior", "--out=t"],
    "lamps": ["s.blend"],
    "demo": [],
}


def test_all_commands_but_probe_are_tried_without_blender() -> None:
    assert {*WITH_BLENDER, "probe"} == set(commands())


@pytest.mark.parametrize("words", [[name, *more] for name, more in WITH_BLENDER.items()])
def test_without_blender_one_line_says_how_to_run(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "s.blend").touch()
    (tmp_path / "run.json").write_text(
        '{"schema": 1, "scene": "s.blend", "unknowns": [], "captures": []}'
    )
    (tmp_path / "f.toml").write_text('[[fit]]\nscene = "s.blend"\n')
    (tmp_path / "f.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "bpy", None)
    assert cli.main(words) == 2
    said = capsys.readouterr().err.splitlines()
    assert len([line for line in said if "blender --command selenite" in line]) == 1
    assert "pip install bpy==" in said[-1]
    assert not list(tmp_path.glob("*/*")) and "Traceback" not in "".join(said)


def test_without_numpy_one_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = ModuleNotFoundError("No module named 'numpy'", name="numpy")
    monkeypatch.setattr(probe, "run", raising(missing))
    assert cli.main(["probe", "a.csv", "--out=b.csv"]) == 2
    assert "pip install numpy" in capsys.readouterr().err


def test_as_a_process_help_goes_where_a_pager_reads_it() -> None:
    command = [sys.executable, "-m", "selenite", "fit", "--help"]
    env = os.environ | {"PYTHONPATH": str(ROOT / "addon")}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("usage: selenite fit") and done.stderr == ""


def raising(error: BaseException) -> Any:  # noqa: ANN401
    def run(_args: argparse.Namespace) -> dict[str, Any]:
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "status", "words"),
    [
        (Failed("the derivative is not finite"), 1, "the derivative is not finite"),
        (MemoryError(), 1, "memory does not suffice"),
        (OSError(28, "No space left on device", "/x/y"), 1, "File '/x/y': no space left on device"),
        (OSError("'a.exr' cannot be written: x; make room"), 1, "'a.exr' cannot be written: x"),
        (KeyboardInterrupt(), 1, "interrupted"),
        (BadInput(Problem("A\nB", "is bad", "mend it")), 2, "A B: is bad; mend it"),
    ],
)
def test_failures_are_sentences(
    error: BaseException,
    status: int,
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(probe, "run", raising(error))
    assert cli.main(["probe", "a.csv", "--out=b.csv", "--json"]) == status
    printed = capsys.readouterr()
    assert words in printed.err and "Traceback" not in printed.err
    assert set(json.loads(printed.out)) == {"problems" if status == 2 else "error"}


def test_a_fault_of_ours_is_named_as_one_and_its_traceback_is_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(cli.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(probe, "run", raising(ZeroDivisionError("division by zero")))
    assert cli.main(["probe", "a.csv", "--out=b.csv"]) == 1
    said = capsys.readouterr().err
    assert "internal error (ZeroDivisionError: division by zero)" in said
    assert "Traceback" not in said
    (path,) = tmp_path.iterdir()
    assert str(path) in said
    text = path.read_text(encoding="utf-8")
    assert "Traceback" in text and "ZeroDivisionError" in text
    monkeypatch.setattr(cli.tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert cli.main(["probe", "a.csv", "--out=b.csv"]) == 1
    assert "Traceback" in capsys.readouterr().err  # nowhere else to keep it


def test_a_log_on_a_full_disk_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        monkeypatch.setattr(sys, "stderr", full)
        terminal.say("x" * 100_000)
        monkeypatch.setattr(sys, "stderr", None)
        terminal.say("closed")
        monkeypatch.undo()
        os.dup2(os.open(os.devnull, os.O_WRONLY), full.fileno())  # so that it can be closed


def test_progress_without_a_terminal_is_a_line_a_second_at_most(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also of short jobs that follow each other, and where a variable asks for colours."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    now = 1000.0
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now)
    said = []
    for job in range(20):
        with terminal.bar(f"job {job}") as shown:
            for step in range(100):
                shown.update(step / 100, note="x")
                if text := capsys.readouterr().err:
                    said.append((now, text))
                now += 0.02
    assert 2 <= len(said) <= 40  # seconds
    assert all(text.count("\n") == 1 for _, text in said)
    assert min(b[0] - a[0] for a, b in pairwise(said)) >= 1


def test_a_misspelt_name_gets_the_one_that_was_meant() -> None:
    names = ["base_color", "roughness", "Key Light"]
    assert choice("rougness", names).startswith("did you mean 'roughness'? use one of 'base_color'")
    assert choice("key light", names).startswith("did you mean 'Key Light'? ")
    assert choice("albedo", names) == "use one of 'base_color', 'roughness', 'Key Light'"


def test_what_the_native_module_refuses_becomes_problems() -> None:
    scene = native.core().SceneBuilder().build()
    with pytest.raises(BadInput) as found, refused("Scene", "correct it"):
        scene.with_values({("Body", "ior"): 1.4})
    assert found.value.problems == [
        Problem(
            "Scene",
            "'Body' is no material or light of the scene",
            "materials: none; lights: none; or 'World'",
        )
    ]
    with pytest.raises(BadInput) as found, refused("Render", "correct it"):
        native.core().render(scene, "Camera", 8, 8, 0)
    assert [item.object for item in found.value.problems] == ["Render"]


def test_all_that_a_fit_refuses_is_there_at_once() -> None:
    core = native.core()
    unknown = core.Unknown("Body", "ior", 2.0, 1.0, [1.4], -1.0)
    with pytest.raises(BadInput) as found, refused("Fit", "change it"):
        core.Fit(core.SceneBuilder().build(), [], [unknown], {"spp": 0, "loss": "l2"})
    problems = found.value.problems
    assert [(item.object, item.cure) for item in problems if item.cure != "change it"]
    assert {item.object for item in problems} >= {"Fit", "No photo to fit to"}
    assert not any(": " in item.cause and ";" in item.cause for item in problems)


def test_an_error_without_problems_is_its_text() -> None:
    with pytest.raises(BadInput) as found, refused("Fit", "change it"):
        raise ValueError("a: b; c")
    assert found.value.problems == [Problem("Fit", "a: b; c", "change it")]


RUN: dict[str, Any] = {
    "schema": 1,
    "scene": "/scenes/one.blend",
    "unknowns": [{"owner": "Body", "parameter": "ior", "start": [1.4], "minimum": 1}],
    "captures": [{"camera": "Camera", "photo": "/photos/Camera.png"}],
    "settings": {},
}


def test_a_plain_run_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps(RUN), encoding="utf-8")
    (unknown,) = read_run(tmp_path / "run.json").unknowns
    assert (unknown.start, unknown.minimum, unknown.maximum) == ((1.4,), 1.0, None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"scene": None}, "'scene' is None"),
        ({"scene": ["a"]}, "'scene' is"),
        ({"scene": "a\0b"}, "'scene' is"),
        ({"unknowns": {}}, "'unknowns' are no list of objects"),
        ({"unknowns": [1]}, "'unknowns' are no list of objects"),
        ({"unknowns": [{"owner": 5, "parameter": "ior"}]}, "'owner' is 5"),
        ({"unknowns": [{"owner": "Body"}]}, "'parameter' is None"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "start": 1.4}]}, "'start' is 1.4"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "start": ["1"]}]}, "'start' is '1'"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "start": [None]}]}, "'start' is"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "minimum": float("nan")}]}, "'minimum'"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "maximum": 10**400}]}, "'maximum'"),
        ({"unknowns": [{"owner": "B", "parameter": "ior", "maximum": True}]}, "'maximum'"),
        ({"unknowns": [{"owner": "B", "parameter": "x", "grid": 7}]}, "'grid' is 7"),
        ({"captures": "photo.png"}, "'captures' are no list"),
        ({"captures": [{"camera": "Camera"}]}, "'photo' is None"),
        (
            {"captures": [{"camera": "C", "photo": "p", "masks": ""}]},
            "'masks' is not known; did you mean 'mask'?",
        ),
        ({"settings": []}, "they are []"),
        ({"settings": {"spp": "4"}}, "'4' is of another type"),
        ({"settings": {"tolerance": 10**400}}, "lies outside"),
        ({"settings": {"iterations": 10**400}}, "lies outside"),
        ({"settings": {"learning_rate": float("nan")}}, "nan lies outside"),
        ({"stages": [{"parameters": [1]}]}, "its parameters are [1]"),
        ({"stages": 5}, "no list of stages"),
        ({"schema": 2}, "its schema is 2"),
    ],
)
def test_a_run_file_with_a_wrong_entry_is_refused(
    change: dict[str, Any], words: str, tmp_path: Path
) -> None:
    (tmp_path / "run.json").write_text(json.dumps(RUN | change), encoding="utf-8")
    with pytest.raises(BadInput) as found:
        read_run(tmp_path / "run.json")
    assert words in str(found.value)


@pytest.mark.parametrize("content", ["[" * 100_000, "null", '"a"', "[]", '{"stages": {}}'])
def test_a_hostile_list_of_stages_is_refused(content: str, tmp_path: Path) -> None:
    (tmp_path / "stages.json").write_text(content, encoding="utf-8")
    with pytest.raises(BadInput):
        read_stages(tmp_path / "stages.json")
    for path in (tmp_path, Path("/dev/zero")):
        with pytest.raises(BadInput):
            read_stages(path)
