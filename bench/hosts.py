# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench hosts`: the table of Blender's properties in every Blender that is at hand.

Each bpy gets an environment of its own, which is removed again (`--keep`), and Debian's Blender is
asked too. Status 1 if one of them has a property that the table does not know, if a row is in none
of them, or if a value that should be named is not.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "devtools"))
from environment import interpreter  # noqa: E402

WALK = ROOT / "bench" / "hosts" / "walk.py"
PLACE = ROOT / "build" / "venv-hosts"
# bpy -> the Python and the numpy that it is built for
HOSTS = {
    "4.2.23": ("3.11", "1.26.4"),
    "4.5.15": ("3.11", "1.26.4"),
    "5.0.1": ("3.11", "1.26.4"),
    "5.2.3": ("3.13", "2.3.5"),
    "5.3.0": ("3.13", "2.3.5"),
}
DEBIAN = "Debian's Blender"
CLASSES = ("modelled", "no effect on radiance", "refused", "warned of")
LONGEST = 900  # seconds for a host


def environment(host, python, numpy):
    """An environment with one bpy; returns its Python."""
    place = PLACE / host
    inside = place / "bin" / "python"
    if not (place / "complete").exists():
        subprocess.run([python, "-m", "venv", "--clear", str(place)], check=True)
        quiet = [
            "--disable-pip-version-check",
            "--no-input",
            "--quiet",
            "--no-deps",
            "--no-compile",
        ]
        packages = [f"bpy=={host}", f"numpy=={numpy}"]
        subprocess.run([str(inside), "-m", "pip", "install", *quiet, *packages], check=True)
        (place / "complete").touch()
    return str(inside)


def walked(command):
    """The report of one host, or a text that says why there is none."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "report.json"
        settings = {**os.environ, "BLENDER_USER_RESOURCES": folder, "TMPDIR": folder}
        try:
            run = subprocess.run(
                [*command, str(out)],
                capture_output=True,
                text=True,
                timeout=LONGEST,
                check=False,
                env=settings,
            )
        except subprocess.TimeoutExpired:
            return f"it did not end within {LONGEST} s"
        if not out.is_file():
            return f"status {run.returncode}: {(run.stdout + run.stderr)[-2000:]}"
        return json.loads(out.read_text())


def hosts(versions, keep, script):
    """(name, the command that runs `script` in it, to which its arguments are added) of each bpy
    and of Debian's Blender, or (name, why there is none). The environment of a bpy is there until
    the next one is asked for.
    """
    for host in versions:
        version, numpy = HOSTS.get(host, ("3.13", "2.3.5"))
        python = interpreter(version)
        if python is None:
            yield f"bpy {host}", f"skipped: no Python {version} is at hand"
            continue
        try:
            yield f"bpy {host}", [environment(host, python, numpy), str(script)]
        except subprocess.CalledProcessError as error:
            yield f"bpy {host}", f"cannot be installed: {error}"
        finally:
            if not keep:
                shutil.rmtree(PLACE / host, ignore_errors=True)
    blender = shutil.which("blender")
    if blender is None:
        yield DEBIAN, "skipped: there is no Blender on the path"
    else:
        yield DEBIAN, [blender, "-b", "--factory-startup", "--python", str(script), "--"]


def table_of(reports, per_type):
    """Counts by class and host; with `per_type`, a row for each RNA type."""
    lines = ["| host | " + " | ".join(CLASSES) + " | all |", "|---|" + "---|" * 5]
    for report in reports.values():
        total = Counter()
        for counts in report["counts"].values():
            total.update(counts)
        numbers = " | ".join(str(total[name]) for name in CLASSES)
        lines.append(f"| {report['version']} | {numbers} | {total.total()} |")
    if per_type:
        last = list(reports.values())[-1]
        lines += ["", f"| type ({last['version']}) | " + " | ".join(CLASSES) + " |"]
        lines.append("|---|" + "---|" * 4)
        for name, counts in last["counts"].items():
            numbers = " | ".join(str(counts.get(key, 0)) for key in CLASSES)
            lines.append(f"| {name} | {numbers} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(prog="./dev bench hosts", description=__doc__)
    parser.add_argument("hosts", nargs="*", default=list(HOSTS), help="versions of bpy")
    parser.add_argument("--keep", action="store_true", help="keep the environments")
    parser.add_argument("--types", action="store_true", help="a row for each type, too")
    options = parser.parse_args()
    reports, faults = {}, []
    for name, command in hosts(options.hosts, options.keep, WALK):
        report = command if isinstance(command, str) else walked(command)
        if isinstance(report, str):
            print(f"{name}: {report}", flush=True)
            if not report.startswith("skipped"):
                faults.append(f"{name}: {report.splitlines()[0]}")
            continue
        reports[name] = report
        print(f"{name}: {report['cases']} values named, {len(report['unnamed'])} not", flush=True)
        for kind in ("unknown", "factory", "unnamed"):
            faults += [f"{name}: {kind}: {item}" for item in report[kind]]
    if reports:
        print("\n" + table_of(reports, options.types))
        nowhere = set.intersection(*(set(report["absent"]) for report in reports.values()))
        if set(options.hosts) >= set(HOSTS) and len(reports) == len(HOSTS) + 1:
            faults += [f"no Blender has {item}" for item in sorted(nowhere)]
        else:
            print("not every host was asked: rows that none has are not judged")
    print("\n".join(["", *faults] if faults else ["", "every property is known"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
