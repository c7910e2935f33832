# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench clicks`: the first fit by real clicks in a window of Blender, its clicks counted.

A virtual display; words of the panel are found in pictures of it, so nothing is scrolled and what
is covered is not found. From Open Sample Scene to applied values: clicks, seconds, values beside
the true ones, what the panel says. Status 1 with more than six clicks or a wrong value.

Another Blender is driven by its command (`--blender "chroot FOLDER blender"`), from a zip of
`./dev package` (`--package`); it has to see this checkout at the same path.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
SCENE = ROOT / "scenes" / "jade_pendant"
MOST_CLICKS = 6
#: A value is right within this.
TOLERANCE = 0.02
#: The letters of Blender's panels are too small for tesseract as they are.
ENLARGED = 2
LONGEST = 900  # seconds of a step
SOCKETS = {
    "base_color": ("Base Color",),
    "roughness": ("Roughness",),
    "transmission": ("Transmission Weight", "Transmission"),
    "ior": ("IOR",),
}
INSTALL = """import bpy
zip = {zip!r}
if bpy.app.version >= (4, 2):
    bpy.ops.extensions.package_install_files(
        filepath=zip, repo='user_default', enable_on_install=True)
else:
    bpy.ops.preferences.addon_install(filepath=zip)
    bpy.ops.preferences.addon_enable(module='selenite')
"""
PREFERENCES = """import bpy
bpy.context.preferences.view.show_splash = False
bpy.ops.wm.save_userpref()
"""


@dataclass(frozen=True)
class Word:
    """One that a picture of the display shows: its line, and its middle in pixels."""

    text: str
    line: tuple[str, ...]
    x: int
    y: int


@dataclass
class Walk:
    """One window that is driven by clicks."""

    out: Path
    seen_at: Path
    clicks: list[str] = field(default_factory=list)
    pictures: int = 0
    #: Seconds in which pictures were read: a person sees at once
    reading: float = 0.0

    def picture(self, name: str) -> Path:
        """Of the whole display, kept."""
        path = self.out / f"{self.pictures:02}_{name}.png"
        self.pictures += 1
        subprocess.run(["import", "-window", "root", path], check=True)
        return path

    def seen(self) -> dict[str, Any]:
        """What the window's Blender has last written."""
        try:
            found: dict[str, Any] = json.loads(self.seen_at.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        return found

    def wait(self, what: str, holds: Callable[[dict[str, Any]], bool]) -> float:
        """Seconds until the window's Blender shows it."""
        began = time.monotonic()
        while True:
            seen = self.seen()
            if "trouble" not in seen and seen and holds(seen):
                return time.monotonic() - began
            if time.monotonic() - began > LONGEST:
                self.picture("in_vain")
                raise SystemExit(f"waited in vain for {what}: {json.dumps(seen, indent=1)}")
            time.sleep(0.1)

    def find(self, words: str, last: bool, sideways: bool = False) -> tuple[int, int]:
        """The place of a text of the display: the first or last from above; `sideways`: on a tab.

        It has to be there at once or after a redraw.
        """
        for attempt in range(20):
            if places := self.places(words, sideways, of_light=attempt % 2 == 0):
                return places[-1 if last else 0]
            time.sleep(0.5)
        self.picture("not_found")
        raise SystemExit(f"the display does not show '{words}'")

    def places(
        self, words: str, sideways: bool = False, of_light: bool = True
    ) -> list[tuple[int, int]]:
        """Where the display shows them now, from above. of_light: as letters that are light
        whatever is behind them; else by their contrast, as those under the pointer."""
        began = time.monotonic()
        path = self.out / "now.png"
        subprocess.run(["import", "-window", "root", path], check=True)
        found = _places(path, words, sideways, of_light)
        self.reading += time.monotonic() - began
        return found

    def click(self, words: str, last: bool = False, sideways: bool = False) -> None:
        """As a person does: the pointer goes there and presses the left button."""
        x, y = self.find(words, last, sideways)
        self.clicks.append(words)
        press(x, y)


def press(x: int, y: int) -> None:
    """Blender takes a press where it has seen the pointer before."""
    for word in (["mousemove", x - 3, y], ["mousemove", x, y]):
        subprocess.run(["xdotool", *map(str, word)], check=True)
        time.sleep(0.3)
    subprocess.run(["xdotool", "click", "1"], check=True)


def _places(picture: Path, words: str, sideways: bool, of_light: bool) -> list[tuple[int, int]]:
    """Where neighbouring words of one line are these, from above."""
    wanted = words.split()
    found = []
    shown = _words(picture, sideways, of_light)
    for index in range(len(shown) - len(wanted) + 1):
        here = shown[index : index + len(wanted)]
        same_line = len({word.line for word in here}) == 1
        if same_line and [word.text for word in here] == wanted:
            found.append((sum(word.x for word in here) // len(here), here[0].y))
    return sorted(found, key=lambda place: place[1])


def _words(picture: Path, sideways: bool, of_light: bool) -> list[Word]:
    """All that tesseract reads in a picture; `sideways`: what is written from below to above."""
    large = picture.with_name("large.png")
    turn = ["-rotate", "90"] if sideways else []
    levels = ["-level", "55%,85%"] if of_light else []
    enlarge = ["-colorspace", "Gray", *levels, "-negate", "-resize", f"{100 * ENLARGED}%"]
    subprocess.run(["convert", picture, *turn, *enlarge, large], check=True)
    height = int(
        subprocess.run(
            ["identify", "-format", "%h", picture], check=True, capture_output=True, text=True
        ).stdout
    )
    read = subprocess.run(
        ["tesseract", large, "-", "--psm", "11", "tsv"], check=True, capture_output=True, text=True
    ).stdout
    words = []
    for row in csv.DictReader(read.splitlines(), delimiter="\t", quoting=csv.QUOTE_NONE):
        if not row["text"].strip():
            continue
        x = (int(row["left"]) + int(row["width"]) // 2) // ENLARGED
        y = (int(row["top"]) + int(row["height"]) // 2) // ENLARGED
        line = (row["block_num"], row["par_num"], row["line_num"])
        place = (y, height - 1 - x) if sideways else (x, y)
        words.append(Word(row["text"].strip(), line, *place))
    return words


def walk(it: Walk, view: tuple[int, int]) -> dict[str, Any]:
    """From the panel's sample scene to applied values, then Cycles' opinion."""
    it.wait("the window", lambda seen: seen["is_idle"])
    time.sleep(2)
    subprocess.run(["xdotool", "mousemove", *map(str, view), "key", "n"], check=True)
    time.sleep(1)
    # Blender 4 opens the sidebar at its first tab.
    if not any(it.places("Open Sample Scene") for _ in range(4)):
        it.click("Selenite", sideways=True)
        time.sleep(1)
    it.picture("panel")
    it.clicks.clear()
    began, it.reading = time.monotonic(), 0.0
    seconds = {}

    it.click("Open Sample Scene")
    seconds["open"] = it.wait(
        "the sample scene", lambda seen: seen["file"].endswith("start.blend") and seen["is_idle"]
    )
    it.find("Load Photos", last=False)
    it.picture("sample")
    it.click("Load Photos")
    while len(it.places("Load Photos")) < 2:  # noqa: PLR2004 - the panel's, and the browser's below
        time.sleep(1)
    it.picture("browser")
    it.click("Load Photos", last=True)
    seconds["load"] = it.wait(
        "photos", lambda seen: len(seen["captures"]) == 2 and bool(seen["ticked"])
        and seen["is_idle"],
    )  # fmt: skip
    it.find("Start Fit", last=False)
    it.picture("ready")
    it.click("Start Fit")
    started = time.monotonic()
    it.wait("the fit", lambda seen: seen["phase"] is not None)
    in_sight = False
    while not in_sight and it.seen().get("phase"):
        in_sight = bool(it.places("Stop"))
    it.picture("running")
    it.wait("its end", lambda seen: len(seen["results"]) == 4 and seen["is_idle"])
    seconds["fit"] = time.monotonic() - started
    it.find("Apply", last=False)
    it.picture("result")
    before = it.seen()
    it.click("Apply")
    it.wait("applied values", lambda seen: seen["applied"])
    whole = time.monotonic() - began - it.reading
    time.sleep(1)
    it.picture("applied")
    applied, clicks = it.seen(), list(it.clicks)

    it.click("Check in Cycles")
    seconds["check"] = it.wait("the check in Cycles", lambda seen: bool(seen["check"]))
    time.sleep(2)
    it.picture("checked")
    return {
        "clicks": clicks,
        "seconds": {name: round(value, 1) for name, value in seconds.items()},
        "seconds_of_all": round(whole, 1),
        "stop_in_sight": in_sight,
        "said_before": {name: before[name] for name in ("message", "verdict", "warnings")},
        "said_by_check": it.seen()["check"],
        **{name: applied[name] for name in ("blender", "python", "module", "problems")},
        "values": {
            name: next(applied["nodes"][item] for item in sockets if item in applied["nodes"])
            for name, sockets in SOCKETS.items()
        },
    }


def errors(values: dict[str, Any]) -> dict[str, float]:
    """Largest distance of each value from the true one."""
    truth = json.loads((SCENE / "truth.json").read_text())["parameters"]
    return {
        name: max(abs(a - b) for a, b in zip(_list(values[name]), _list(true), strict=False))
        for name, true in truth.items()
    }


def _list(value: Any) -> list[float]:  # noqa: ANN401 - a number or numbers
    return list(value) if isinstance(value, (list, tuple)) else [value]


@contextmanager
def display(size: str) -> Iterator[str]:
    """A virtual one, with its own name."""
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", f"{size}x24", "+extension", "GLX"]
    with subprocess.Popen(
        [*command, "+render", "-noreset"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as process:
        try:
            assert process.stdout is not None
            yield f":{process.stdout.readline().decode().strip()}"
        finally:
            process.terminate()


@contextmanager
def window(command: list[str | Path], log: Path) -> Iterator[None]:
    """Blender's, which is ended with the block."""
    with log.open("w") as said, subprocess.Popen(command, stdout=said, stderr=said) as process:
        try:
            yield
        finally:
            process.terminate()


def main() -> int:
    parser = argparse.ArgumentParser(prog="./dev bench clicks", description=__doc__)
    parser.add_argument("--blender", default="blender", help="command (%(default)s)")
    parser.add_argument("--package", type=Path, help="zip that is installed (the checkout's code)")
    parser.add_argument("--size", default="1600x1000", help="of the window (%(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "clicks")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(130))  # takes window and display along
    out = options.out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    os.environ.update(
        {
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "BLENDER_USER_RESOURCES": str(out / "settings"),
            "TMPDIR": str(out),
            "OMP_THREAD_LIMIT": "1",  # of tesseract, which is slower with several
        }
    )
    blender = shlex.split(options.blender)
    install = INSTALL.format(zip=str(options.package.resolve())) if options.package else ""
    subprocess.run(
        [*blender, "-b", "--python-exit-code", "1", "--python-expr", install + PREFERENCES],
        check=True,
    )
    width, height = (int(word) for word in options.size.split("x"))
    seen_at = out / "seen.json"
    with display(options.size) as name:
        os.environ["DISPLAY"] = name
        watch = ["--python", ROOT / "bench" / "clicks" / "watch.py", "--", seen_at]
        checkout = [] if options.package else [ROOT]
        at = ["--no-window-focus", "--window-geometry", "0", "0", str(width), str(height)]
        with window([*blender, *at, *watch, *checkout], out / "log.txt"):
            it = Walk(out, seen_at)
            found = walk(it, (width // 3, height // 2))
    off = errors(found["values"])
    found["off_by"] = {name: round(value, 4) for name, value in off.items()}
    (out / "report.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    print(json.dumps(found, indent=1))
    said = (out / "log.txt").read_text(errors="replace")
    fine = "Traceback" not in said and found["stop_in_sight"]
    fine = fine and len(found["clicks"]) <= MOST_CLICKS and max(off.values()) <= TOLERANCE
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
