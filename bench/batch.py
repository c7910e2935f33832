# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench batch`: a batch of many small fits, three of which cannot do their work.

A ball in photos of our own, a colour for each fit. One photo is corrupt, one scene is missing, and
one fit asks for what no photo shows. Status 1 unless all others have results with the true colours,
the batch names exactly the two without a result, and the third says that its value is not
determined. Chromium, where it is installed, makes a picture of the page: build/batch/page.png.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "blender_tests")]

import bpy  # noqa: E402
import made_scenes as made  # type: ignore[import-not-found]  # noqa: E402
import numpy as np  # noqa: E402

from selenite.cli import main as selenite  # noqa: E402
from selenite.report.batch_page import PAGE  # noqa: E402

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
#: How far a fitted channel may be from the truth, after so few samples.
_WITHIN = 0.05
#: Numbers of the fits that cannot do their work.
_CORRUPT, _MISSING, _UNSEEN = 17, 42, 77
_DEFAULTS = """[defaults]
scene = "ball.blend"
fit = "Body:base_color"
height = 16
iterations = 8
spp = 16
picture_spp = 16
threads = 1
"""


def written(home: Path, count: int) -> tuple[Path, dict[str, list[float]]]:
    """The file of a batch, and the true colours of its fits that have one."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    made.studio(base_color=(0.5, 0.5, 0.5), roughness=0.5)
    made.light("Key Light", energy=40)
    scene = made.save(home / "ball.blend")
    random = np.random.default_rng(1)
    text, truth = _DEFAULTS, {}
    for number in range(count):
        name = f"fit {number:03}"
        colour = random.uniform(0.1, 0.9, 3).round(3).tolist()
        photo = home / f"{number:03}.exr"
        words = ["render", scene, f"--out={photo}", "--spp=64", f"--seed={1000 + number}"]
        values = ",".join(map(str, colour))
        if selenite([*words, "--set", f"Body:base_color={values}"]):
            raise SystemExit(f"no photo of {name}")
        text += f'\n[[fit]]\nname = "{name}"\nphoto = {{ Camera = "{photo.name}" }}\n'
        if number == _CORRUPT:
            photo.write_bytes(photo.read_bytes()[:400])
        elif number == _MISSING:
            text += 'scene = "nowhere.blend"\n'
        elif number == _UNSEEN:
            text += 'fit = "Body:coat_roughness"\n'
        else:
            truth[name] = colour
    file = home / "fits.toml"
    file.write_text(text, encoding="utf-8")
    return file, truth


def main() -> int:
    """Prints what the batch has come to."""
    asked = argparse.ArgumentParser(prog="./dev bench batch", description=__doc__)
    asked.add_argument("--fits", type=int, default=100, help="(%(default)s)")
    asked.add_argument("--jobs", default="2", help="(%(default)s)")
    asked.add_argument("--scheduler", help="as of selenite batch")
    options = asked.parse_args()
    home = ROOT / "build" / "batch"
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir(parents=True)
    file, truth = written(home, options.fits)
    words = ["batch", str(file), "--jobs", options.jobs, "--json"]
    begin = time.perf_counter()
    if options.scheduler:
        words += ["--scheduler", options.scheduler]
    status = selenite(words)
    seconds = time.perf_counter() - begin
    out = home / "fits-fits"
    rows = {row["name"]: row for row in json.loads((out / "batch.json").read_text())["fits"]}
    done = [name for name, row in rows.items() if row["status"] == "done"]
    print(f"{len(done)} of {len(rows)} fits have results, {seconds:.0f} s, status {status}")
    for name in sorted(set(rows) - set(done)):
        print(f"{name}: {rows[name]['status']}: {'; '.join(rows[name]['reasons'])}")
    found = {name: _parameters(out / rows[name]["folder"]) for name in done}
    off = {
        name: float(np.abs(np.subtract(found[name]["Body:base_color"]["value"], colour)).max())
        for name, colour in truth.items()
        if name in found
    }
    print(f"largest error of a colour: {max(off.values()):.3f} (limit {_WITHIN})")
    good = status == 1 and sorted(set(rows) - set(done)) == [
        f"fit {number:03}" for number in (_CORRUPT, _MISSING) if number < options.fits
    ]
    good &= max(off.values()) <= _WITHIN
    if unseen := found.get(f"fit {_UNSEEN:03}"):
        determined = [one["determined"] for one in unseen.values()]
        print(f"fit {_UNSEEN:03}: determined {determined}")
        good &= not any(determined)
    if BROWSER is not None:
        _picture(out / PAGE, home / "page.png")
    return int(not good)


def _parameters(folder: Path) -> dict[str, dict]:
    return json.loads((folder / "result.json").read_text())["parameters"]


def _picture(page: Path, shot: Path) -> None:
    """What a browser shows of a page."""
    subprocess.run(
        [
            str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
            "--window-size=1100,2400", f"--screenshot={shot}", page.as_uri(),
        ],
        check=True, capture_output=True, timeout=120,
    )  # fmt: skip
    print(f"page: {shot}")


if __name__ == "__main__":
    sys.exit(main())
