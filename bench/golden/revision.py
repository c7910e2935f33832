# SPDX-License-Identifier: GPL-3.0-or-later
"""The two revisions: where their packages are, how the older one is checked out and built."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / "build" / "golden"
_PRESET, _TARGETS = "release", ("_core", "_image")


@dataclass(frozen=True)
class Revision:
    """name: for tables. package: its addon/selenite, native modules included. folder: for all that
    it makes."""

    name: str
    package: Path
    folder: Path


class NotBuilt(RuntimeError):
    """A revision cannot be had; the text says why."""


def working_tree() -> Revision:
    """What `./dev bench golden` has just built."""
    return Revision("working tree", ROOT / "addon" / "selenite", PLACE / "working_tree")


def checked_out(name: str) -> Revision:
    """A commit as a git worktree under build/golden, built there unless it was before."""
    commit = _git("rev-parse", "--verify", f"{name}^{{commit}}")
    folder = PLACE / commit[:12]
    tree = folder / "tree"
    package = tree / "addon" / "selenite"
    if not (folder / "built").is_file():
        _git("worktree", "prune")
        if tree.is_dir():
            _git("worktree", "remove", "--force", str(tree))
        folder.mkdir(parents=True, exist_ok=True)
        _git("worktree", "add", "--detach", str(tree), commit)
        _build(tree)
        for target in _TARGETS:
            (module,) = (tree / "build" / _PRESET).glob(f"{target}.*.so")
            shutil.copy2(module, package / module.name)
        (folder / "built").touch()
    return Revision(commit[:12], package, folder)


def removed(revision: Revision) -> None:
    """Gives back what `checked_out` made."""
    _git("worktree", "remove", "--force", str(revision.folder / "tree"))
    shutil.rmtree(revision.folder)


def _build(tree: Path) -> None:
    """Only what Python loads, for this checkout's environment."""
    options = [f"-DPython_EXECUTABLE={sys.executable}"]
    options += ["-DSELENITE_TESTS=OFF", "-DSELENITE_BENCH=OFF"]
    _run(["cmake", "--preset", _PRESET, *options], tree)
    _run(["cmake", "--build", "--preset", _PRESET, "--target", *_TARGETS], tree)


def _run(command: list[str], folder: Path) -> None:
    if subprocess.call(command, cwd=folder):
        raise NotBuilt(f"'{' '.join(command[:3])} ...' failed in {folder}")


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise NotBuilt(f"git {' '.join(words[:2])}: {done.stderr.strip()}")
    return done.stdout.strip()
