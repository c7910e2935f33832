# SPDX-License-Identifier: GPL-3.0-or-later
"""Virtual environments with pinned packages, and the native modules in the checkout."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from process import (
    BUILD,
    PACKAGE,
    PYTHON,
    ROOT,
    VENV,
    Failed,
    alone,
    digest,
    is_stamped,
    run,
    say,
    write_if_other,
    write_stamp,
)


def interpreter(version: str, headers: bool = False) -> Path | None:
    """A Python of this version ("3.13") that runs, from the path or from pyenv; None without one.

    `headers`: only one that native modules can be built for.
    """
    versions = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    candidates = [
        shutil.which(f"python{version}"),
        *sorted(versions.glob(f"{version}.*/bin/python")),
    ]
    program = (
        "import sys, sysconfig; from pathlib import Path\n"
        "print('%d.%d' % sys.version_info[:2],"
        " (Path(sysconfig.get_path('include')) / 'Python.h').is_file())"
    )
    for candidate in filter(None, candidates):
        command = [str(candidate), "-c", program]
        try:
            said = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        except OSError:
            continue
        if said.stdout.split() in ([version, "True"], [version, str(headers)]):
            return Path(str(candidate))
    return None


def ensure_environment(place: Path, requirements: Path, python_of: Path | None = None) -> Path:
    """A virtual environment that holds `requirements`; returns its Python.

    `python_of`: the Python that it is made with; None for the one that runs this.
    """
    if python_of is None and sys.version_info[:2] != (3, 11):
        raise Failed(f"Python 3.11 is needed (Blender's), this is {sys.version.split()[0]}")
    python = place / "bin" / "python3"
    base = str((python_of or Path(sys.executable)).resolve())
    stamp = place / "selenite.stamp"
    key = digest([requirements, base, str(place)])
    with alone(place.name):
        if not is_stamped(stamp, key):
            made_here = (place / "pyvenv.cfg").is_file() and python.exists()
            if not made_here or python.resolve() != Path(base):
                say(f"making {place.name} with {base}")
                run([base, "-m", "venv", "--clear", place])
            say(f"installing {requirements.relative_to(ROOT)} into {place.name}")
            quietly = ["--disable-pip-version-check", "--no-input", "--quiet"]
            run([python, "-m", "pip", "install", *quietly, "--no-deps", "-r", requirements])
            write_stamp(stamp, key)
    return python


def ensure_development() -> None:
    """`.venv` with everything pinned, the add-on importable, `selenite` on its path."""
    ensure_environment(VENV, ROOT / "requirements" / "dev.txt")
    site = VENV / "lib" / "python3.11" / "site-packages"
    write_if_other(site / "selenite.pth", f"{PACKAGE.parent}\n")
    script = VENV / "bin" / "selenite"
    write_if_other(
        script,
        f"#!{PYTHON}\nimport sys\n\nfrom selenite.cli import main\n\nsys.exit(main())\n",
    )
    script.chmod(0o755)


def build(preset: str = "release", targets: Sequence[str] = ()) -> Path:
    """Configures and builds a preset; the release build's modules go into the add-on.

    `targets`: only these, for who needs no tests.
    """
    directory = BUILD / preset
    werror = "ON" if os.environ.get("CI") else "OFF"
    configured = directory / "selenite.stamp"
    key = digest([ROOT / "CMakePresets.json", werror, str(ROOT)])
    with alone(preset):
        if not is_stamped(configured, key) or not (directory / "build.ninja").is_file():
            if (directory / "CMakeCache.txt").is_file() and not configured.is_file():
                (directory / "CMakeCache.txt").unlink()
            run(["cmake", "--preset", preset, f"-DSELENITE_WERROR={werror}"])
            write_stamp(configured, key)
        only = ["--target", *targets] if targets else []
        run(["cmake", "--build", "--preset", preset, *only])
        if preset == "release":
            _put_modules(directory)
    return directory


def _put_modules(directory: Path) -> None:
    """Copies `_core` and `_image` beside the Python sources.

    A process that has the old file loaded keeps it: the new one is renamed over it.
    """
    modules = []
    for name in ("_core", "_image"):
        built = sorted(directory.glob(f"{name}.*.so"))
        if not built:
            raise Failed(f"the build made no {name}")
        source, target = built[-1], PACKAGE / built[-1].name
        modules.append(source)
        if target.is_file() and digest([target]) == digest([source]):
            continue
        partial = target.with_suffix(".partial")
        shutil.copy2(source, partial)
        partial.replace(target)
        say(f"updated {target.relative_to(ROOT)}")
    # A missing symbol shows only when a module is loaded; tests would take that for "not built".
    loads, key = directory / "loads.stamp", digest(modules)
    if not is_stamped(loads, key):
        run([PYTHON, "-c", "import selenite._core, selenite._image"])
        write_stamp(loads, key)


def clean(everything: bool) -> None:
    """Removes what `./dev` made; the environments only if `everything`."""
    for path in [
        BUILD,
        ROOT / "dist",
        *PACKAGE.glob("*.so"),
        *PACKAGE.glob("*.pyd"),
        PACKAGE / "lib",
    ]:
        if path.is_dir():
            shutil.rmtree(path)
        elif path.exists():
            path.unlink()
    if everything:
        for path in [VENV, ROOT / ".venv-lint", *ROOT.glob(".venv-package*")]:
            shutil.rmtree(path, ignore_errors=True)
