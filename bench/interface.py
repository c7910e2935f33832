# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench interface`: what a fit of a large scene costs the interface of Blender 3.4.

A window under a virtual display counts ten ticks a second while a scene of many faces is read, its
photos too, while it is fitted to its end, and while the result is saved; then Cancel and Esc are
timed. Rows: phase, ticks, the share that was lost, the longest time that the interface was blocked.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "devtools"), str(ROOT / "addon")]

import numpy as np  # noqa: E402

from gui_test import window_command  # noqa: E402
from selenite import native  # noqa: E402

SCRIPT = ROOT / "bench" / "interface" / "large_scene.py"
PHOTO = (1280, 1920)  # rows, columns


def write_photos(folder: Path, count: int) -> None:
    """A grey disc on a darker ground, a little brighter from photo to photo."""
    rows, columns = np.mgrid[: PHOTO[0], : PHOTO[1]]
    away = np.hypot(rows - PHOTO[0] / 2, columns - PHOTO[1] / 2) / PHOTO[0]
    shape = np.where(away < 0.3, 1.0 - away, 0.1)[..., None].astype(np.float32)
    for index in range(count):
        photo = np.repeat(shape * (0.2 + 0.1 * index / count), 3, axis=2)
        native.image().write_png(str(folder / f"View {index:02}.png"), photo)


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench interface", description=__doc__)
    parser.add_argument("--faces", type=int, default=393_216, help="%(default)s")
    parser.add_argument("--captures", type=int, default=4, help="%(default)s")
    parser.add_argument("--height", type=int, default=128, help="of the photos (%(default)s)")
    parser.add_argument("--iterations", type=int, default=20, help="%(default)s")
    parser.add_argument("--modifier", action="store_true", help="the faces come from a modifier")
    parser.add_argument("--repeat", type=int, default=1, help="of Refresh and Start (%(default)s)")
    parser.add_argument("--size", default="640x480", help="of the window (%(default)s)")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_photos(folder, options.captures)
        settings = {
            "SELENITE_BENCH_FACES": options.faces,
            "SELENITE_BENCH_HEIGHT": options.height,
            "SELENITE_BENCH_ITERATIONS": options.iterations,
            "SELENITE_BENCH_MODIFIER": int(options.modifier),
            "SELENITE_BENCH_PHOTOS": folder,
            "SELENITE_BENCH_REPEAT": options.repeat,
        }
        command, env = window_command(SCRIPT, options.size, folder)
        env = {**os.environ, **env, **{key: str(value) for key, value in settings.items()}}
        return subprocess.run(command, env=env, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
