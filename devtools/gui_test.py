# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev gui-test`: scripts that drive a Blender 3.4 window under a virtual display.

A script of blender_tests/gui/ passes if Blender ends with status 0 (`bpy.ops.wm.quit_blender()`)
and has printed no traceback. Screenshots go into the folder named by SELENITE_PICTURES.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
from pathlib import Path

from process import BUILD, ROOT, TIMED_OUT, Failed, run_limited, say
from tally import Tally

RUN_IN_WINDOW = ROOT / "devtools" / "run_in_window.py"
#: Programs that wait for each core, above which a window that takes too long proves nothing.
BUSY = 3.0
#: Esc, Stop, Cancel, undo and a file load during a run; small, since a display without a graphics
#: card draws slowly.
SHORT, SHORT_SIZE = ROOT / "blender_tests" / "gui" / "fit_in_window.py", "640x480"


def run_tests(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev gui-test")
    parser.add_argument("scripts", nargs="*", type=Path, help="default: all of blender_tests/gui")
    parser.add_argument("--size", default="1600x1000", help="of the window (%(default)s)")
    parser.add_argument("--limit", type=float, default=600, help="seconds a script (%(default)s)")
    options = parser.parse_args(arguments)
    scripts = [path.resolve() for path in options.scripts]
    scripts = scripts or sorted((ROOT / "blender_tests" / "gui").glob("[a-z]*.py"))
    failed = sum(not _passes(path, options.size, options.limit) for path in scripts)
    print(f"{len(scripts) - failed} passed, {failed} failed")
    return 1 if failed or not scripts else 0


def short_run(limit: float) -> Tally:
    """The part that belongs to every test run; skipped where there is no display to be had."""
    missing = [name for name in ("blender", "xvfb-run") if shutil.which(name) is None]
    if missing:
        say(f"window: skipped, no {' and no '.join(missing)}")
        return Tally(skipped=1)
    status, passed = _run(SHORT, SHORT_SIZE, limit)
    busy = os.getloadavg()[0] / (os.cpu_count() or 1)
    if status == TIMED_OUT and busy > BUSY:
        say(f"window: skipped, {busy:.0f} programs wait for each core")
        return Tally(skipped=1)
    return Tally(passed=int(passed), failed=int(not passed))


def _passes(script: Path, size: str, limit: float) -> bool:
    return _run(script, size, limit)[1]


def _run(script: Path, size: str, limit: float) -> tuple[int, bool]:
    """(exit status or TIMED_OUT, whether all is well)"""
    for program in ("blender", "xvfb-run"):
        if shutil.which(program) is None:
            raise Failed(f"'{program}' is missing")
    pictures = BUILD / "gui-test" / script.stem
    shutil.rmtree(pictures, ignore_errors=True)
    pictures.mkdir(parents=True)
    log = pictures / "log.txt"
    command, env = window_command(script, size, pictures)
    shell = ["bash", "-c", '"$@" > "$0" 2>&1', str(log), *command]
    status = asyncio.run(run_limited(shell, limit, env))
    text = log.read_text(errors="replace")
    passed = status == 0 and "Traceback (most recent call last)" not in text
    if not passed:
        print(text[-6000:])
    say(f"{script.stem}: {'passed' if passed else f'failed (status {status})'}, see {pictures}")
    return status, passed


def window_command(script: Path, size: str, folder: Path) -> tuple[list[str], dict[str, str]]:
    """What runs a script in a Blender window, and what its environment needs. folder: for its
    pictures, settings and other files."""
    width, height = size.split("x")
    command = ["xvfb-run", "-a", "-s", f"-screen 0 {size}x24 +extension GLX +render -noreset"]
    command += ["blender", "--factory-startup", "--enable-event-simulate", "--no-window-focus"]
    command += ["--window-geometry", "0", "0", width, height]
    command += ["--python-exit-code", "1", "--python", str(RUN_IN_WINDOW), "--", str(script)]
    env = {
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "SELENITE_PICTURES": str(folder),
        "SELENITE_SOURCE_DIR": str(ROOT),
        "BLENDER_USER_RESOURCES": str(folder / "settings"),
        "TMPDIR": str(folder),
    }
    return command, env
