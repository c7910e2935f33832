# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of `selenite batch`: words of the command line for each fit, or every reason why not."""

from __future__ import annotations

from pathlib import Path

import pytest

from selenite.commands.batch.entries import Entry, read_entries
from selenite.problems import BadInput


def entries(tmp_path: Path, text: str) -> list[Entry]:
    path = tmp_path / "fits.toml"
    path.write_text(text, encoding="utf-8")
    return read_entries(path)


def problems(tmp_path: Path, text: str) -> list[str]:
    with pytest.raises(BadInput) as caught:
        entries(tmp_path, text)
    return [problem.line() for problem in caught.value.problems]


def test_keys_become_options_and_a_fit_s_own_value_rules(tmp_path: Path) -> None:
    found = entries(
        tmp_path,
        """
        [defaults]
        preset = "draft"
        height = 48
        align = true
        [[fit]]
        scene = "cup.blend"
        fit = ["Cup:base_color,roughness", "World:strength"]
        photo = { Front = "front.png", "Side = 2" = "side.png" }
        bounds = { "Cup:roughness" = [0.1, 0.9] }
        background = [1, 1, 0.5]
        [[fit]]
        name = "the cup again"
        scene = "cup.blend"
        height = 96
        align = false
        accumulate = false
        learning_rate = 0.01
        """,
    )
    assert found[0].name == "cup"
    assert found[0].words == (
        "cup.blend", "--preset=draft", "--height=48", "--align",
        "--fit=Cup:base_color,roughness", "--fit=World:strength",
        "--photo=Front=front.png", "--photo=Side = 2=side.png",
        "--bounds=Cup:roughness=0.1,0.9", "--background=1,1,0.5",
    )  # fmt: skip
    assert found[1].name == "the cup again"
    assert found[1].words == (
        "cup.blend", "--preset=draft", "--height=96", "--no-accumulate", "--learning-rate=0.01",
    )  # fmt: skip


def test_a_resumed_fit_keeps_what_its_run_does_not(tmp_path: Path) -> None:
    (found,) = entries(
        tmp_path,
        '[[fit]]\nscene = "a.blend"\nspp = 8\nsave = "b.blend"\ncheck-in-cycles = true\n',
    )
    assert found.resumed_words == ("--save=b.blend", "--check-in-cycles")


def test_everything_that_is_wrong_is_said_at_once(tmp_path: Path) -> None:
    found = problems(
        tmp_path,
        """
        title = "mine"
        [[fit]]
        name = "one"
        [[fit]]
        name = "ONE"
        scene = "a.blend"
        roughnes = 1
        out = "here"
        [[fit]]
        name = "a/b"
        scene = "a.blend"
        spp = true
        save = ["a.blend", { b = 1 }]
        """,
    )
    wanted = (
        "'title'", "it has no scene", "another fit has the name 'ONE'", "'roughnes' is no option",
        "the batch gives 'out' itself", "is none for a folder", "'spp' cannot be True",
        "'save' cannot be",
    )  # fmt: skip
    assert len(found) == len(wanted)
    for words in wanted:
        assert any(words in line for line in found), words


def test_a_value_that_the_command_refuses_names_its_fit(tmp_path: Path) -> None:
    (line,) = problems(tmp_path, '[[fit]]\nscene = "a.blend"\nspp = "many"\n')
    assert line.startswith("Fit 'a': argument --spp") and "many" in line


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("", "it has no list of tables 'fit'"),
        ("fit = 3", "it has no list of tables 'fit'"),
        ("[[fit]\n", "it is not TOML"),
        ('defaults = 1\n[[fit]]\nscene = "a.blend"', "'defaults' is no table"),
    ],
)
def test_a_file_of_another_kind_is_refused(tmp_path: Path, text: str, cause: str) -> None:
    assert any(cause in line for line in problems(tmp_path, text))


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="it does not exist"):
        read_entries(tmp_path / "nowhere.toml")
    path = tmp_path / "latin.toml"
    path.write_bytes("# Größe\n".encode("latin-1"))
    with pytest.raises(BadInput, match="not text in UTF-8"):
        read_entries(path)
