# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench windows`: Selenite's modules for Windows, built here and tried by Wine.

Loads them inside Blender's wheel for Windows, compares a render of the start scene and the demo's
fit with this system's, runs the native tests and some of pytest's, and uses the zip of
`./dev package --platform windows` as a person would, if dist/ has one. Status 1 if a step fails.
The first time it downloads 370 MB and installs Wine.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "devtools"))
import cross  # noqa: E402
import wine  # noqa: E402
from process import BUILD, PACKAGE, PYTHON  # noqa: E402

WORK = BUILD / "windows-report"
ROOMS = ("math", "model", "scene", "image", "render", "fit")
RUN_PYTEST = ROOT / "devtools" / "run_pytest.py"
# Photos of each container, imports; in Blender cancelling, resuming, saving, worker processes
TESTS = (
    *(f"tests/python/test_{name}.py" for name in ("photo_files", "captures", "fit_binding")),
    "tests/python/importers",
    *(f"blender_tests/test_{name}.py" for name in ("resume", "batch", "cycles_worker", "import")),
)
LARGEST_SHARE = 1e-3  # of an unknown's interval, by which two fits may differ
LARGEST_DIFFERENCE = 1e-6  # of a render's mean, relative
LONGEST = 3600


class Failed(Exception):
    """A step; its text says what is wrong."""


def loads(_options: argparse.Namespace) -> str:
    program = (
        "import bpy, selenite._core as core, selenite._image as image; "
        "print('Blender', bpy.app.version_string, core.__version__ == image.__version__)"
    )
    text = _python("-c", program)
    if "True" not in text:
        raise Failed(text[-300:])
    return next(line for line in text.splitlines() if line.startswith("Blender"))


def start_scene(_options: argparse.Namespace) -> str:
    """Means of the kernels, here and there, and their CPU time."""
    here, there = _both("start_scene.py")
    if here["lanes"] != there["lanes"]:
        raise Failed(f"lanes: {here['lanes']!r} here, {there['lanes']!r} there")
    worst = max(abs(a / b - 1) for a, b in zip(here["means"], there["means"], strict=True))
    if worst > LARGEST_DIFFERENCE:
        raise Failed(f"means differ by {worst:.1e}: {here['means']}, {there['means']}")
    pairs = zip(here["seconds"], there["seconds"], strict=True)
    times = ", ".join(f"{there:.2f} s for {here:.2f} s" for here, there in pairs)
    return f"means differ by {worst:.1e} at most; CPU {times}"


def start_fit(_options: argparse.Namespace) -> str:
    """A fit of a few values, without a file."""
    here, there = _both("start_fit.py")
    worst = _farthest(here["shares"], there["shares"])
    (ours, here), (theirs, there) = ((one["iterations"], one["seconds"]) for one in (here, there))
    times = f"{there / theirs:.3f} s for {here / ours:.3f} s"
    return (
        f"values differ by {worst:.1e} of an interval at most; {theirs} iterations for {ours}, "
        f"CPU each {times}"
    )


def _both(script: str) -> tuple[Any, Any]:
    """What a script of bench/windows prints here and there."""
    path = ROOT / "bench" / "windows" / script
    env = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    text = subprocess.run(
        [PYTHON, path], capture_output=True, text=True, check=True, env=env
    ).stdout
    # Blender says more, before and after.
    here, there = (json.loads(re.findall(r"^\{.*\}$", said, re.MULTILINE)[-1])
                   for said in (text, _python(path)))  # fmt: skip
    return here, there


def _farthest(here: dict[str, float], there: dict[str, float]) -> float:
    """Between values as shares of their intervals."""
    if here.keys() != there.keys():
        raise Failed(f"other values: {here}, {there}")
    worst = max(abs(here[name] - there[name]) for name in here)
    if worst > LARGEST_SHARE:
        raise Failed(f"values differ by {worst:.1e} of an interval: {here}, {there}")
    return worst


def demo(_options: argparse.Namespace) -> str:
    """The same fit, and its folder has a name that is not ASCII."""
    out = WORK / "Ergebnis für Müller"
    shutil.rmtree(out, ignore_errors=True)
    words = ("-m", "selenite", "demo", "--json", "--out")
    env = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
    since = time.perf_counter()
    subprocess.run(
        [PYTHON, *words, out / "here"], check=True, capture_output=True, env=env, cwd=WORK
    )
    between = time.perf_counter()
    _python(*words, out / "there")
    times = f"{between - since:.0f} s here, {time.perf_counter() - between:.0f} s there"
    here, there = (_fitted(out / name) for name in ("here", "there"))
    worst = _farthest(here, there)
    return f"{len(here)} values differ by {worst:.1e} of an interval at most; {times}"


def _fitted(folder: Path) -> dict[str, float]:
    """Values as shares of the interval that the fit searched."""
    (path,) = folder.rglob("result.json")
    shares = {}
    for name, item in json.loads(path.read_text(encoding="utf-8"))["parameters"].items():
        values = item["value"] if isinstance(item["value"], list) else [item["value"]]
        for index, value in enumerate(values):
            shares[f"{name}[{index}]"] = value / (item["maximum"] - item["minimum"])
    return shares


def native(options: argparse.Namespace) -> str:
    """GoogleTest's counts, beside those of this system's programs."""
    rows, faults = [], []
    for room in options.rooms:
        name = f"{room}_tests"
        filters = [f"--gtest_filter={options.filter}"] if options.filter else []
        here = BUILD / "release" / "tests" / name
        listed = subprocess.run([here, "--gtest_list_tests", *filters], capture_output=True,
                                text=True, check=True).stdout  # fmt: skip
        known = sum(line.startswith("  ") for line in listed.splitlines())
        status, text = wine.output(
            wine.TREE / "tests" / f"{name}.exe", "--gtest_brief=1", *filters, seconds=LONGEST
        )
        (WORK / f"{name}.log").write_text(text)
        counts = {word: int(n) for word, n in re.findall(r"\[  (\w+)\s+\] (\d+) tests?", text)}
        passed, skipped = counts.get("PASSED", 0), counts.get("SKIPPED", 0)
        rows.append(f"{room} {passed} of {known}" + f", {skipped} skipped" * bool(skipped))
        if status or passed + skipped != known:
            faults.append(f"{name}: status {status}, {rows[-1]}, see {WORK / name}.log")
    if faults:
        raise Failed("; ".join(faults))
    return "; ".join(rows)


def tests(options: argparse.Namespace) -> str:
    """Files of pytest, each in a process."""
    rows, faults = [], []
    for name in options.tests:
        status, text = wine.output("python", RUN_PYTEST, name, "-q", seconds=LONGEST)
        (WORK / f"{Path(name).stem}.log").write_text(text)
        # Blender says more after pytest's last line.
        counts = re.findall(r"^=* ?(\d+ \w+.* in [\d.]+s.*?)[ =]*$", text, re.MULTILINE)
        rows.append(f"{Path(name).stem}: {counts[-1] if counts else text.strip()[-100:]}")
        if status:
            faults.append(rows[-1])
    if faults:
        raise Failed("; ".join(faults))
    return "; ".join(rows)


def wheels(_options: argparse.Namespace) -> str:
    """Those of dist/ in the Pythons that they are for; each module tests itself when it loads."""
    rows = []
    for version in cross.PYTHONS["windows"]:
        tag = "cp" + version.replace(".", "")
        found = sorted((ROOT / "dist").glob(f"selenite-*-{tag}-{tag}-win_amd64.whl"))
        if not found:
            rows.append(f"{version} skipped: run ./dev package --platform windows before")
            continue
        opened = WORK / f"wheel-{version}"
        shutil.rmtree(opened, ignore_errors=True)
        with zipfile.ZipFile(found[-1]) as archive:
            archive.extractall(opened)
        status, text = wine.output(
            f"python{version}", "-c", "import selenite._core, selenite._image",
            variables={"PYTHONPATH": wine.windows_path(opened)},
        )  # fmt: skip
        if status:
            raise Failed(f"Python {version}: status {status}: {text[-300:]}")
        rows.append(f"Python {version} loads {found[-1].name}")
    return "; ".join(rows)


def extension(_options: argparse.Namespace) -> str:
    """The zip, installed into an empty home and used; the demo's package is not on the path."""
    found = sorted((ROOT / "dist").glob("selenite-*-extension-windows-x64.zip"))
    if not found:
        return "skipped: run ./dev package --platform windows before"
    # Outside the checkout: what is used must not be found there.
    home = Path(tempfile.gettempdir()) / "selenite-windows-home"
    shutil.rmtree(home, ignore_errors=True)
    home.mkdir()
    variables = {
        name: wine.windows_path(home)
        for name in ("BLENDER_USER_RESOURCES", "BLENDER_USER_SCRIPTS", "BLENDER_USER_CONFIG")
    }
    text = _python(
        ROOT / "bench" / "hosts" / "use.py", found[-1], home / "use",
        variables={**variables, "PYTHONPATH": wine.windows_path(wine.SITE)},
    )  # fmt: skip
    report = home / "use" / "report.json"
    if not report.is_file():
        raise Failed(text[-300:])
    steps = json.loads(report.read_text(encoding="utf-8"))["steps"]
    if faults := {name: step for name, step in steps.items() if step["said"][:2] == "NO"}:
        raise Failed(f"{faults}")
    return f"{found[-1].name}: {', '.join(steps)}"


def _python(*words: str | Path, variables: dict[str, str] | None = None) -> str:
    status, text = wine.output("python", *words, seconds=LONGEST, cwd=WORK, variables=variables)
    if status:
        raise Failed(f"status {status}: {text[-600:]}")
    return text


STEPS: dict[str, Callable[[argparse.Namespace], str]] = {
    "loads": loads,
    "start-scene": start_scene,
    "start-fit": start_fit,
    "demo": demo,
    "native": native,
    "tests": tests,
    "wheels": wheels,
    "extension": extension,
}


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev bench windows", description=__doc__)
    parser.add_argument("steps", nargs="*", default=list(STEPS), help=f"of {', '.join(STEPS)}")
    parser.add_argument("--rooms", nargs="+", choices=ROOMS, default=list(ROOMS))
    parser.add_argument("--filter", default="", help="of GoogleTest, for native")
    parser.add_argument("--tests", nargs="+", default=list(TESTS), help="files of pytest")
    options = parser.parse_args(arguments)
    if unknown := set(options.steps) - STEPS.keys():
        parser.error(f"there is no step {', '.join(sorted(unknown))}")
    wine.ensure()
    wine.build(() if "native" in options.steps else ("_core", "_image"))
    WORK.mkdir(parents=True, exist_ok=True)
    failed = 0
    for name in options.steps:
        since = time.perf_counter()
        try:
            said = STEPS[name](options)
        except (Failed, subprocess.CalledProcessError) as error:
            said, failed = f"NO: {error}", failed + 1
        print(f"| {name} | {time.perf_counter() - since:.0f} s | {said} |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
