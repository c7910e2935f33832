# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev bench NAME` runs bench/NAME.py (- for _), or the program built from bench/NAME.cpp."""

from __future__ import annotations

import subprocess

import environment
from process import BUILD, PYTHON, ROOT, Failed

# These race or compare with Mitsuba, which has an environment of its own; `./dev` knows them too.
WITH_MITSUBA = ("equivalence", "fit-race", "race", "texture-race")

# These need the Python modules and nothing else of the build.
WITH_MODULES_ONLY = ("golden", "guard", "mutants", "race")


def targets(arguments: list[str]) -> tuple[str, ...]:
    """What has to be built; nothing means all."""
    return ("_core", "_image") if arguments[:1] and arguments[0] in WITH_MODULES_ONLY else ()


def run_bench(arguments: list[str]) -> int:
    """Without a name, lists what can be measured."""
    scripts = {path.stem.replace("_", "-"): path for path in sorted((ROOT / "bench").glob("*.py"))}
    programs = {path.name[6:]: path for path in sorted((BUILD / "release/bench").glob("bench_*"))}
    if not arguments:
        print("\n".join(f"./dev bench {name}" for name in sorted({*scripts, *programs})))
        return 0
    name, rest = arguments[0], arguments[1:]
    if name in scripts:
        command = [str(PYTHON), str(scripts[name])]
        if name in WITH_MITSUBA:
            place, pinned = BUILD / "venv-peer", ROOT / "requirements" / "peer.txt"
            command += ["--peer-python", str(environment.ensure_environment(place, pinned))]
        command += rest
    elif name in programs:
        command = [str(programs[name]), *rest]
    else:
        raise Failed(f"there is no benchmark '{name}'; ./dev bench lists them")
    return subprocess.call(command)
