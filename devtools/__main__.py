# SPDX-License-Identifier: GPL-3.0-or-later
"""The jobs of this repository; `./dev` calls this with the distribution's Python."""

from __future__ import annotations

import argparse
import os
import sys

import bench
import environment
import gui_test
import lint
import package
import testing
from process import VENV, Failed, say

HELP = """usage: ./dev JOB [arguments]

  setup              install what is missing: Debian packages, .venv with the pinned packages
  build [PRESET]     build; the release preset (default) also puts the modules into addon/selenite
  demo [...]         `selenite demo`: a fit from start to result on a scene made on the spot
  test [...]         all tests; ./dev test --help tells how to run some
  lint [...]         clang-format, clang-tidy, ruff, types; --fix mends what can be mended
  bench [NAME ...]   measure speed; without a name, list what there is
  package [...]      wheel, Blender extension and legacy add-on in dist/; --platform for others
  gui-test [...]     drive the panel in a Blender window under a virtual display
  clean [--all]      remove builds; with --all the environments too
"""


def setup() -> None:
    environment.ensure_development()


def build(arguments: list[str]) -> None:
    setup()
    for preset in arguments or ["release"]:
        environment.build(preset)


def demo(arguments: list[str]) -> int:
    setup()
    environment.build("release", targets=("_core", "_image"))
    return _replace_by([str(VENV / "bin" / "selenite"), "demo", *arguments])


def clean(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="./dev clean")
    parser.add_argument("--all", action="store_true", help="remove the environments too")
    environment.clean(parser.parse_args(arguments).all)


def _replace_by(command: list[str]) -> int:
    """Becomes `command`, which keeps the caller's folder, terminal and signals."""
    sys.stdout.flush()
    sys.stderr.flush()
    os.execv(command[0], command)


def main(arguments: list[str]) -> int:
    job, rest = (arguments[0], arguments[1:]) if arguments else ("help", [])
    if job in ("help", "-h", "--help"):
        print(HELP, end="")
        return 0
    if job == "setup":
        setup()
    elif job == "build":
        build(rest)
    elif job == "demo":
        return demo(rest)
    elif job == "test":
        options = testing.parse(rest)
        build([])
        return testing.run_tests(options)
    elif job == "gui-test":
        build([])
        return gui_test.run_tests(rest)
    elif job == "lint":
        build([])
        return lint.run_lint(rest)
    elif job == "bench":
        setup()
        environment.build("release", targets=bench.targets(rest))
        return bench.run_bench(rest)
    elif job == "package":
        setup()
        package.make(rest)
    elif job == "clean":
        clean(rest)
    else:
        raise Failed(f"there is no job '{job}'\n\n{HELP}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except Failed as failure:
        say(str(failure))
        sys.exit(1)
    except KeyboardInterrupt:
        sys.exit(130)
