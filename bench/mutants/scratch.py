# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of the working tree in which mutants live; the tree itself is never touched."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .catalogue import Mutant

_PRESET = "release"
_LIMIT = 900  # seconds for a process of tests: a mutant may hang
_PYTEST_FAILED, _TIMED_OUT = 1, 124
_PYTEST_ERRORS = (2, 3, 4, 5)  # interrupted by errors of collection, internal, usage, no tests
_RUNNER = """import os, sys, pytest
status = pytest.main(sys.argv[1:])
sys.stdout.flush()
sys.stderr.flush()
os._exit(int(status))"""  # Blender as a module can hang on its way out


class NotBuilt(RuntimeError):
    """The sources of the scratch tree do not compile; the text is the compiler's."""


@dataclass(frozen=True)
class Outcome:
    """Of the tests of a mutant: caught, survived or broken, and by which test or by what."""

    word: str
    by: str = ""


class ScratchTree:
    """Sources of the working tree under `folder`/tree, with the native modules or a build."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.root, self.tree, self.folder = root, folder / "tree", folder

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Two runs would undo each other's mutants."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / "lock").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise NotBuilt(f"{self.folder} is in use by another run; wait for it") from error
            yield

    def refresh(self) -> None:
        """Makes the tree equal to the working tree; what is equal keeps its time, so that little
        is built again."""
        listed = _git(self.root, "ls-files", "-co", "--exclude-standard", "-z").split("\0")
        wanted = {name for name in listed if name and (self.root / name).is_file()}
        wanted |= {str(path.relative_to(self.root)) for path in (self.root / "addon").rglob("*.so")}
        for name in wanted:
            source, target = self.root / name, self.tree / name
            if target.is_file() and target.read_bytes() == source.read_bytes():
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
            os.utime(target)
        for path in [path for path in self.tree.rglob("*") if path.is_file()]:
            name = path.relative_to(self.tree)
            if str(name) not in wanted and name.parts[0] != "build":
                path.unlink()

    @contextmanager
    def with_mutant(self, mutant: Mutant) -> Iterator[None]:
        """The fault is in the tree for the length of a block."""
        path = self.tree / mutant.file
        before = path.read_text(encoding="utf-8")
        path.write_text(before.replace(mutant.old, mutant.new), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(before, encoding="utf-8")

    def build(self, target: str) -> None:
        """Compiles what has changed for one target. Raises NotBuilt."""
        build = self.tree / "build" / _PRESET
        if not (build / "build.ninja").is_file():
            options = [f"-DPython_EXECUTABLE={sys.executable}", "-DSELENITE_BENCH=OFF"]
            self._run(["cmake", "--preset", _PRESET, *options])
        self._run(["cmake", "--build", str(build), "--target", target])
        if not target.endswith("_tests"):
            (module,) = build.glob(f"{target}.*.so")
            shutil.copy2(module, self.tree / "addon" / "selenite" / module.name)

    def _run(self, command: list[str]) -> None:
        done = subprocess.run(command, cwd=self.tree, capture_output=True, text=True, check=False)
        if done.returncode:
            raise NotBuilt("\n".join((done.stdout + done.stderr).splitlines()[-30:]))

    def test(self, mutant: Mutant, log: Path) -> Outcome:
        """Runs the mutant's tests on the tree as it is."""
        if mutant.program:
            return self._gtest(mutant, log)
        files: dict[str, list[str]] = {}
        for name in mutant.tests:  # a process for each file: one can load one Blender once
            files.setdefault(name.partition("::")[0], []).append(name)
        outcome = Outcome("survived")
        for names in files.values():
            outcome = self._pytest(names, log)
            if outcome.word != "survived":
                break
        return outcome

    def _pytest(self, names: list[str], log: Path) -> Outcome:
        words = [sys.executable, "-c", _RUNNER, *names, "-x", "-q", "-p", "no:cacheprovider"]
        scratch = self.folder / "tmp"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        env = {
            "TMPDIR": str(scratch),
            "BLENDER_USER_RESOURCES": str(scratch),
            "SELENITE_SOURCE_DIR": str(self.tree),
            "PYTHONPATH": str(self.tree / "addon"),
            # compiled files know sources by size and second
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        status, text = self._limited(words, env, log)
        failed = re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE)
        passed = re.search(r"\b(\d+) passed", text)
        if status in _PYTEST_ERRORS or (status == 0 and not passed):
            return Outcome("broken", failed[1] if failed else f"pytest ended with status {status}")
        if status == 0:
            return Outcome("survived", f"{passed[1]} passed" if passed else "")
        return Outcome("caught", _test_of(failed, status, _PYTEST_FAILED))

    def _gtest(self, mutant: Mutant, log: Path) -> Outcome:
        program = self.tree / "build" / _PRESET / "tests" / f"{mutant.program}_tests"
        words = [str(program), f"--gtest_filter={mutant.filter}", "--gtest_fail_fast"]
        status, text = self._limited(words, {}, log)
        ran = re.search(r"(\d+) tests? from \d+ test suites? ran", text)
        failed = re.search(r"^\[  FAILED  \] ([^\s,]+)", text, re.MULTILINE)
        if status == 0:
            if not ran or ran[1] == "0":
                return Outcome("broken", f"no test of {mutant.program} is called {mutant.filter}")
            return Outcome("survived", f"{ran[1]} passed")
        return Outcome("caught", _test_of(failed, status, 1))

    def _limited(self, words: list[str], env: dict[str, str], log: Path) -> tuple[int, str]:
        with log.open("w") as output:
            process = subprocess.Popen(
                words,
                cwd=self.tree,
                env={**os.environ, **env},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            status = _TIMED_OUT
            try:
                status = process.wait(_LIMIT)
            except subprocess.TimeoutExpired:
                pass
            finally:  # also where somebody ends this run
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        return status, log.read_text(errors="replace")


def _test_of(failed: re.Match[str] | None, status: int, usual: int) -> str:
    """The test that failed first, and how the process ended if that was unusual."""
    name = failed[1].rpartition("/")[2] if failed else "(no test named)"
    if status == _TIMED_OUT:
        return f"{name}: did not end in {_LIMIT} s"
    return name if status == usual else f"{name}: ended with status {status}"


def _git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True)
    return done.stdout
