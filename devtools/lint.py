# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev lint`: format, static checks and types of the C++ and Python sources."""

from __future__ import annotations

import argparse
import re
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import environment
from process import BUILD, JOBS, PYTHON, ROOT, digest, is_stamped, say, write_stamp

CPP_FOLDERS = ("native", "tests", "bench")

# What mypy and the stubs of bpy cannot know and therefore report of correct code
UNKNOWABLE = re.compile(
    "|".join(
        (
            'has no attribute "selenite"',  # the add-on's own property group on Scene
            r'"\*\*dict',  # keyword arguments out of a dictionary
            # attributes of the subclass that a base class stands for (a Light is a PointLight)
            '"(ActionStrip|ID|Light|Modifier|Node|NodeSocket|PropertyGroup)" has no attribute',
            '"Color"(; expected "Iterable| has no attribute "__iter__)',  # is iterable
            'Argument "icon" to "\\w+" of "UILayout" has incompatible type "str"',  # computed
            'base class "(Panel|Operator|UIList)" defined the type as "Literal',  # plain str
        )
    )
)
PYTHON_FOLDERS = ("addon", "devtools", "tests", "blender_tests", "bench", "scenes")


def run_lint(arguments: list[str]) -> int:
    parser = argparse.ArgumentParser(prog="./dev lint")
    parser.add_argument("checks", nargs="*", metavar="CHECK", help=", ".join(CHECKS))
    parser.add_argument("--fix", action="store_true", help="mend what the formatters and ruff can")
    options = parser.parse_args(arguments)
    unknown = set(options.checks) - set(CHECKS)
    if unknown:
        parser.error(f"there is no check {', '.join(sorted(unknown))}")
    failed = []
    for name, check in CHECKS.items():
        if options.checks and name not in options.checks:
            continue
        passed = check(options.fix)
        say(f"{name}: {'clean' if passed else 'FAILED'}")
        if not passed:
            failed.append(name)
    return 1 if failed else 0


def _cpp_files(*suffixes: str) -> list[Path]:
    found = (path for folder in CPP_FOLDERS for path in sorted((ROOT / folder).rglob("*")))
    return [path for path in found if path.suffix in suffixes]


def _clang_format(fix: bool) -> bool:
    files = _cpp_files(".cpp", ".h")
    return not files or _succeeds("clang-format", *(["-i"] if fix else ["-n", "--Werror"]), *files)


def _clang_tidy(fix: bool) -> bool:
    """Of native/ as the release build compiles it; again only when a file or a header changed."""
    database = _clang_database(BUILD / "release")
    headers = [*_cpp_files(".h"), ROOT / ".clang-tidy", ROOT / "cmake" / "compiler.cmake"]
    shared = digest(headers)
    listed = (database / "compile_commands.json").read_text()
    found = [*(ROOT / "native").rglob("*.cpp"), *(BUILD / "release" / "kernels").glob("*.cpp")]
    sources = [path for path in sorted(found) if f'"{path}"' in listed]

    def check(source: Path) -> bool:
        stamp = BUILD / "tidy" / source.relative_to(ROOT).with_suffix(".stamp")
        key = digest([shared, source])
        if is_stamped(stamp, key):
            return True
        result = subprocess.run(
            ["clang-tidy", "--quiet", "-p", str(database), str(source)],
            capture_output=True,
            text=True,
            cwd=ROOT,
        )
        if result.returncode == 0:
            write_stamp(stamp, key)
        else:
            print(result.stdout + result.stderr, flush=True)
        return result.returncode == 0

    with ThreadPoolExecutor(JOBS) as pool:
        return all(list(pool.map(check, sources)))


def _clang_database(compiled: Path) -> Path:
    """A folder with the compile commands, without the options that only GCC knows."""
    folder = BUILD / "tidy"
    folder.mkdir(parents=True, exist_ok=True)
    text = (compiled / "compile_commands.json").read_text()
    (folder / "compile_commands.json").write_text(re.sub(r" -m(move|store)-max=\d+", "", text))
    return folder


def _ruff(fix: bool) -> bool:
    folders = [ROOT / name for name in PYTHON_FOLDERS if (ROOT / name).is_dir()]
    ruff = PYTHON.parent / "ruff"
    checked = _succeeds(ruff, "check", "--quiet", *(["--fix"] if fix else []), *folders)
    formatted = _succeeds(ruff, "format", "--quiet", *([] if fix else ["--diff"]), *folders)
    return checked and formatted


def _types(fix: bool) -> bool:
    """mypy against the stubs of Blender 4.5, in an environment without the real bpy."""
    python = environment.ensure_environment(ROOT / ".venv-lint", ROOT / "requirements" / "lint.txt")
    sources = [ROOT / "addon" / "selenite", *sorted((ROOT / "devtools").glob("*.py"))]
    command: list[str | Path] = [python, "-m", "mypy", "--no-error-summary", *sources]
    command += ["--cache-dir", BUILD / "mypy"]
    result = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    lines = [line for line in result.stdout.splitlines() if not UNKNOWABLE.search(line)]
    print("\n".join([*lines, result.stderr]).strip(), flush=True)
    return result.returncode in (0, 1) and not any(": error: " in line for line in lines)


def _succeeds(*command: str | Path) -> bool:
    return subprocess.call([str(word) for word in command], cwd=ROOT) == 0


CHECKS: dict[str, Callable[[bool], bool]] = {
    "clang-format": _clang_format,
    "clang-tidy": _clang_tidy,
    "ruff": _ruff,
    "types": _types,
}
