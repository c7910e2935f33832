# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench mutants` on a tree of two files: what it calls caught, survived and broken."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "bench"))

from mutants import catalogue  # noqa: E402
from mutants.catalogue import BadCatalogue, Mutant  # noqa: E402
from mutants.scratch import ScratchTree  # noqa: E402

ROW = """
[[mutant]]
name = "{name}"
file = "sums.py"
old = "a + b"
new = "{new}"
fault = "sums are wrong"
tests = ["test_sums.py"]
"""
MUTANT = Mutant("minus", "sums.py", "a + b", "a - b", "sums are wrong", ("test_sums.py",))


@pytest.fixture
def tree(tmp_path: Path) -> ScratchTree:
    """A copy of a repository whose one test looks at one sum."""
    root = tmp_path / "root"
    root.mkdir()
    (root / "sums.py").write_text("def add(a, b):\n    return a + b\n\n\nZERO = 0  # unused\n")
    (root / "test_sums.py").write_text(
        "import os, sys\n\nsys.path.insert(0, os.path.dirname(__file__))\n"
        "import sums\n\n\ndef test_sum():\n    assert sums.add(1, 2) == 3\n"
    )
    (root / "pyproject.toml").write_text("[tool.pytest.ini_options]\n")
    (root / "addon").mkdir()
    subprocess.run(["git", "init", "--quiet", str(root)], check=True)
    made = ScratchTree(root, tmp_path / "scratch")
    made.folder.mkdir()
    made.refresh()
    return made


def outcome(tree: ScratchTree, mutant: Mutant) -> str:
    with tree.with_mutant(mutant):
        assert mutant.new in (tree.tree / mutant.file).read_text()
        found = tree.test(mutant, tree.folder / "log")
    assert (tree.tree / mutant.file).read_bytes() == (tree.root / mutant.file).read_bytes()
    return found.word


def test_a_mutant_that_a_test_notices_is_caught(tree: ScratchTree) -> None:
    assert tree.test(MUTANT, tree.folder / "log").word == "survived", "the tree as it is"
    assert outcome(tree, MUTANT) == "caught"
    assert tree.test(MUTANT, tree.folder / "log").word == "survived", "nothing is left of it"


def test_one_that_changes_nothing_that_is_tested_survives(tree: ScratchTree) -> None:
    assert outcome(tree, replace(MUTANT, old="ZERO = 0", new="ZERO = 1")) == "survived"


def test_one_that_does_not_load_or_has_no_tests_is_broken(tree: ScratchTree) -> None:
    assert outcome(tree, replace(MUTANT, new="a +* b")) == "broken"
    (tree.tree / "test_sums.py").write_text("# no test\n")
    assert tree.test(MUTANT, tree.folder / "log").word == "broken"


def test_the_tree_follows_the_working_tree_and_never_changes_it(tree: ScratchTree) -> None:
    before = {path.name: path.read_bytes() for path in tree.root.glob("*.py")}
    with tree.with_mutant(MUTANT):
        assert {path.name: path.read_bytes() for path in tree.root.glob("*.py")} == before
        tree.refresh()  # as after a run that was ended half way
        assert (tree.tree / "sums.py").read_bytes() == before["sums.py"]
    (tree.root / "sums.py").unlink()
    (tree.root / "more.py").write_text("MORE = 1\n")
    tree.refresh()
    assert not (tree.tree / "sums.py").exists() and (tree.tree / "more.py").is_file()


def test_old_text_has_to_be_there_once(tree: ScratchTree) -> None:
    root = tree.root
    assert catalogue.unfit([MUTANT], root) == []
    for wrong, text in (
        (replace(MUTANT, old="a * b"), "0 times"),
        (replace(MUTANT, old="a"), "times in sums.py, not once"),
        (replace(MUTANT, file="gone.py"), "no file gone.py"),
        (replace(MUTANT, tests=("test_gone.py",)), "no test test_gone.py"),
    ):
        (fault,) = catalogue.unfit([wrong], root)
        assert text in fault and "minus" in fault


def test_tables_are_checked(tmp_path: Path) -> None:
    table = tmp_path / "sums.toml"
    table.write_text(ROW.format(name="minus", new="a - b"))
    assert catalogue.load(tmp_path) == [MUTANT]
    for row, text in (
        (ROW.format(name="same", new="a + b"), "old and new are equal"),
        (ROW.format(name="x", new="b").replace("fault", "falt"), "'falt' is not known"),
        (ROW.format(name="x", new="b").replace('tests = ["test_sums.py"]', ""), "either tests or"),
        (2 * ROW.format(name="twin", new="b"), "'twin' is there twice"),
    ):
        table.write_text(row)
        with pytest.raises(BadCatalogue, match=text):
            catalogue.load(tmp_path)


def test_the_tables_of_this_repository_can_be_read() -> None:
    """Whether they still apply is told by `./dev bench mutants --list`, when it is asked."""
    found = catalogue.load()
    assert len(found) >= 80
    assert any(item.is_native for item in found) and any(not item.is_native for item in found)
