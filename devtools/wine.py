# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows' programs on Linux, by Wine: Python with Blender's wheel, and Selenite's native tests.

Wine stands in for Windows 10. It has runtime libraries of its own, so it does not show that a
module lacks one (foreign_checks.py does).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import cross
import environment
import static_libraries
from process import BUILD, JOBS, PACKAGE, PYTHON, ROOT, digest, is_stamped, run, say, write_stamp

PYTHON_VERSION = "3.11"
REQUIREMENTS = ROOT / "requirements" / "windows.txt"
FOLDER = cross.CACHE / "cross"
SITE, PREFIX = FOLDER / "site", FOLDER / "wine"
TREE = BUILD / "windows"


def ensure() -> None:
    """A Windows 10, and Blender's wheel and pytest for its Python. Downloads 370 MB once."""
    cross.foreign_python(cross.WINDOWS, PYTHON_VERSION)
    if not is_stamped(FOLDER / "wine.stamp", "win10"):
        say("making a Windows of Wine's")
        for words in (["wineboot", "-i"], ["winecfg", "-v", "win10"]):
            run(["wine", *words], env=_variables())
        run(["wineserver", "-w"], env=_variables())
        write_stamp(FOLDER / "wine.stamp", "win10")
    key = digest([REQUIREMENTS])
    if not is_stamped(FOLDER / "site.stamp", key):
        wheels = FOLDER / "wheels"
        say("fetching Blender's wheel for Windows, and what tests import")
        run([PYTHON, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:",
             "--platform", "win_amd64", "--python-version", PYTHON_VERSION,
             "--dest", wheels, "-r", REQUIREMENTS])  # fmt: skip
        shutil.rmtree(SITE, ignore_errors=True)
        for wheel in wheels.glob("*.whl"):
            with zipfile.ZipFile(wheel) as archive:
                archive.extractall(SITE)
        shutil.rmtree(wheels)
        write_stamp(FOLDER / "site.stamp", key)
    for libraries in SITE.glob("*.data/*lib"):  # where pip puts them too
        shutil.copytree(libraries, SITE, dirs_exist_ok=True)


def build(targets: Sequence[str] = ()) -> Path:
    """Modules and native tests for Windows in build/windows; the modules go into the add-on too."""
    prefix = static_libraries.prefix(cross.WINDOWS)
    python = environment.ensure_environment(
        ROOT / ".venv-package", ROOT / "requirements" / "package.txt"
    )
    settings = {
        **cross.WINDOWS.module_settings(PYTHON_VERSION, prefix),
        "CMAKE_BUILD_TYPE": "Release",
        "CMAKE_CXX_FLAGS_RELEASE": "-O3 -DNDEBUG",
        "Python_EXECUTABLE": str(python),
    }
    key = digest([f"{name}={value}" for name, value in settings.items()])
    if not is_stamped(TREE / "selenite.stamp", key):
        defined = [f"-D{name}={value}" for name, value in settings.items()]
        run(["cmake", "-G", "Ninja", "-S", ROOT, "-B", TREE, "-Wno-dev", *defined])
        write_stamp(TREE / "selenite.stamp", key)
    only = ["--target", *targets] if targets else []
    run(["cmake", "--build", TREE, f"-j{JOBS}", *only])
    for module in TREE.glob("_*.pyd"):
        shutil.copy2(module, PACKAGE / module.name)
    return TREE


def command(program: str | Path, *words: str | Path) -> list[str]:
    """Of a program for Windows; "python" is Blender's, "python3.13" is that version."""
    if isinstance(program, str):
        version = program.removeprefix("python") or PYTHON_VERSION
        program = cross.foreign_python(cross.WINDOWS, version) / "python.exe"
    return ["wine", str(program), *map(windows_path, words)]


def windows_path(word: str | Path) -> str:
    """A path of ours as Windows has it; a str stays what it is."""
    return word if isinstance(word, str) else "Z:" + str(word).replace("/", "\\")


def output(
    program: str | Path,
    *words: str | Path,
    seconds: float = 900,
    cwd: Path = ROOT,
    variables: Mapping[str, str] | None = None,
) -> tuple[int, str]:
    """Exit status and all that it prints. Through a pipe: Python for Windows refuses a file."""
    env = {**os.environ, **_variables(), **(variables or {})}
    # Wine's services start with its first program and outlive it: they must not hold the pipe.
    nowhere = subprocess.DEVNULL
    subprocess.run(["wine", "cmd", "/c", "exit"], env=env, stdin=nowhere, stdout=nowhere,
                   stderr=nowhere, check=True)  # fmt: skip
    with subprocess.Popen(
        command(program, *words), cwd=cwd, env=env, text=True,
        encoding="utf-8", errors="replace",
        stdin=nowhere, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    ) as process:  # fmt: skip
        try:
            text, _ = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            text, _ = process.communicate()
            text += f"\nended after {seconds:.0f} s"
        return process.returncode, text


def _variables() -> dict[str, str]:
    return {
        "WINEPREFIX": str(PREFIX),
        "WINEDEBUG": "-all",
        "DISPLAY": "",
        "PYTHONUTF8": "1",
        "PYTHONPATH": ";".join(map(windows_path, (ROOT / "addon", SITE))),
    }
