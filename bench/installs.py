# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench installs`: installs, uses and removes the packages of dist/ in every Blender.

Each bpy gets an environment of its own, which is removed again (`--keep`), and Debian's Blender
takes part. Status 1 if a step fails in one of them. Run `./dev package` before.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench"))
from hosts import DEBIAN, HOSTS, hosts  # noqa: E402

USE = ROOT / "bench" / "hosts" / "use.py"
STEPS = ("install", "enable", "fit", "apply", "undo", "stop", "cancel", "check_in_cycles",
         "disable", "remove")  # fmt: skip
LONGEST = 1800  # seconds for a host
#: Ends with this status after any property group with a filtered pointer: Blender's own fault
KNOWN_STATUS = {"4.2": -11}


def used(command, package, logs):
    """(the report of one host or None, its exit status) after its Blender has ended by itself."""
    with tempfile.TemporaryDirectory() as folder:
        settings = {
            **os.environ,
            "BLENDER_USER_RESOURCES": folder,
            "BLENDER_USER_SCRIPTS": folder,
            "BLENDER_USER_CONFIG": folder,
            "TMPDIR": folder,
        }
        settings.pop("PYTHONPATH", None)
        out = Path(folder) / "use"
        with logs.open("w") as log:
            try:
                status = subprocess.run(
                    [*command, str(package), str(out)],
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    timeout=LONGEST,
                    check=False,
                    env=settings,
                    cwd=folder,
                ).returncode
            except subprocess.TimeoutExpired:
                status = f"none within {LONGEST} s"
        report = out / "report.json"
        return (json.loads(report.read_text()) if report.is_file() else None), status


def package(pattern):
    """The one file of dist/ with this name."""
    found = sorted((ROOT / "dist").glob(pattern))
    if len(found) != 1:
        raise SystemExit(f"dist/ holds {len(found)} files {pattern}: run ./dev package first")
    return found[0]


def main():
    parser = argparse.ArgumentParser(prog="./dev bench installs", description=__doc__)
    parser.add_argument("hosts", nargs="*", default=list(HOSTS), help="versions of bpy")
    parser.add_argument("--keep", action="store_true", help="keep the environments")
    parser.add_argument("--no-debian", action="store_true", help="only the versions of bpy")
    options = parser.parse_args()
    extension = package("selenite-*-extension.zip")
    legacy = package("selenite-*-blender34-debian.zip")
    logs = ROOT / "build" / "installs"
    logs.mkdir(parents=True, exist_ok=True)
    rows, faults = [], []
    for name, command in hosts(options.hosts, options.keep, USE):
        if name == DEBIAN and options.no_debian:
            continue
        if isinstance(command, str):
            print(f"{name}: {command}", flush=True)
            if not command.startswith("skipped"):
                faults.append(f"{name}: {command}")
            continue
        log = logs / f"{name.replace(' ', '_')}.log"
        report, status = used(command, legacy if name == DEBIAN else extension, log)
        steps = report["steps"] if report else {}
        said = {step: steps.get(step, {}).get("said", "NO: not reached") for step in STEPS}
        faults += [f"{name}: {step}: {text}" for step, text in said.items() if text[:2] == "NO"]
        known = report and KNOWN_STATUS.get(".".join(report["version"].split(".")[:2]))
        if status not in (0, known):
            faults.append(f"{name}: ended with status {status}, see {log.relative_to(ROOT)}")
        cells = ["no" if said[step][:2] == "NO" else "yes" for step in STEPS]
        version = report["version"] if report else "?"
        rows.append(f"| {name} ({version}) | {' | '.join(cells)} | {status} |")
        print(f"{name}: {json.dumps(steps)}", flush=True)
    titles = " | ".join(step.replace("_", " ") for step in STEPS)
    print(f"\n| host | {titles} | exit status |\n|---|{'---|' * (len(STEPS) + 1)}")
    print("\n".join(rows))
    print("\n".join(["", *faults] if faults else ["", "every step worked in every Blender"]))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
