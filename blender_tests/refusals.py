# SPDX-License-Identifier: GPL-3.0-or-later
"""What every refusal of the command line has: status, object, cause, cure, and nothing written."""

import made_scenes as made

from selenite.cli import main


def files_of(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def assert_fit_refused(case, folder, monkeypatch, capsys):
    """case: (what makes the scene and returns more arguments, words of the message)."""
    make, words = case
    monkeypatch.chdir(folder)
    arguments = make(folder)
    scene = made.save(folder / "scene.blend")
    before = files_of(folder)
    status = main(["fit", scene, "--iterations=2", "--height=12", *arguments])
    said = capsys.readouterr().err
    lines = [line for line in said.splitlines() if words in line]
    assert status == 2, said
    assert lines, f"{words} not in {said}"
    name, _, rest = lines[0].removeprefix("fit: ").partition(": ")
    cause, _, cure = rest.partition("; ")
    assert name and cause and cure
    assert "Traceback" not in said
    assert files_of(folder) == before
