# SPDX-License-Identifier: GPL-3.0-or-later
"""`./dev package`: what people install, written to dist/ and tried out before it is called done.

selenite-V-cpXY-cpXY-manylinux_*.whl   one for each Python of Blender's: needs the C library alone
selenite-V-extension.zip               Blender 4.2 and later: those wheels and others
selenite-V-blender34-debian.zip        add-on for Debian 12's Blender 3.4, which has the libraries

With --platform windows or macos, wheels and extension for that: built here, and not tried.

The wheels hold Embree, OpenImageIO and the rest as static libraries (static_libraries.py).
"""

from __future__ import annotations

import argparse
import asyncio
import os
import shutil
import tomllib
import zipfile
from collections.abc import Sequence
from pathlib import Path

import cross
import environment
import foreign_checks
import package_checks
import static_libraries
from process import BUILD, PACKAGE, PYTHON, ROOT, Failed, alone, run, run_limited, say

DIST = ROOT / "dist"
WORK = BUILD / "package"
# Of Blender 4.2 to 5.0, and of Blender 5.1 to 5.3. The first is there, or nothing runs.
PYTHONS = ("3.11", "3.13")
# The C library that Blender asks for; cmake/oldest_glibc.cmake sees to it
GLIBC = (2, 28)
# What a wheel of ours needs at run time beside numpy, which every Blender has
PURE_PYTHON = ("rich", "markdown-it-py", "mdurl", "Pygments", "defusedxml", "platformdirs")

# In an extension the add-on is bl_ext.<repository>.selenite; its native modules are in the wheel.
BRIDGE = """# SPDX-License-Identifier: GPL-3.0-or-later
import sys

from selenite import {name}

sys.modules[__name__] = {name}
"""

# Appended to the legacy add-on's __init__.py
FIND_LIB = """
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "lib"))
"""


def make(arguments: list[str]) -> None:
    parser = argparse.ArgumentParser(prog="./dev package")
    parser.add_argument(
        "--untried", action="store_true", help="do not install the results in Blender"
    )
    parser.add_argument(
        "--platform",
        nargs="+",
        choices=("linux", *cross.PLATFORMS),
        default=["linux"],
        help="what is packed for (linux)",
    )
    options = parser.parse_args(arguments)
    pythons = _pythons()
    with alone("package"):
        shutil.rmtree(WORK, ignore_errors=True)
        WORK.mkdir(parents=True)
        DIST.mkdir(exist_ok=True)
        libraries = _pure_python_wheels(pythons[PYTHONS[0]])
        made = []
        for name in options.platform:
            if name == "linux":
                made += _make_for_linux(pythons, libraries, options.untried)
            else:
                made += _make_for(cross.PLATFORMS[name], pythons, libraries)
    for path in sorted(made):
        print(f"{path.relative_to(ROOT)}  {path.stat().st_size / 1e6:.1f} MB")


def _make_for_linux(pythons: dict[str, Path], libraries: list[Path], untried: bool) -> list[Path]:
    environment.build()
    prefix = static_libraries.prefix()
    _forget("extension.zip", "blender34-debian.zip", "*linux*.whl")
    wheels = [_wheel(version, python, prefix) for version, python in pythons.items()]
    extension = _extension(wheels, libraries, "linux-x64", DIST / f"{_name()}-extension.zip")
    _refuse(package_checks.faults_of_extension(extension, map(_tag, pythons)))
    legacy = _legacy(libraries)
    if not untried:
        _try_extension(extension)
        _try_legacy(legacy)
    return [*wheels, extension, legacy]


def _make_for(
    platform: cross.Platform, pythons: dict[str, Path], libraries: list[Path]
) -> list[Path]:
    """Wheels and extension for a system that does not run here: nothing is tried."""
    prefix = static_libraries.prefix(platform)
    target = f"extension-{platform.in_blender}.zip"
    _forget(target, f"*{platform.tag}.whl")
    wheels = [
        _foreign_wheel(platform, version, python, prefix) for version, python in pythons.items()
    ]
    extension = _extension(
        wheels, libraries, platform.in_blender, DIST / f"{_name()}-{target}", platform.tried
    )
    _refuse(package_checks.faults_of_extension(extension, map(_tag, pythons)))
    return [*wheels, extension]


def _forget(*endings: str) -> None:
    for ending in endings:
        for old in DIST.glob(f"selenite-*-{ending}"):
            old.unlink()


def _tag(version: str) -> str:
    return "cp" + version.replace(".", "")


def _refuse(faults: Sequence[str]) -> None:
    """What is not as it must be stays in dist/ to be looked at, but the job fails."""
    if faults:
        raise Failed("this is no package:\n  " + "\n  ".join(faults))


def _pythons() -> dict[str, Path]:
    """Version -> an environment with what builds a wheel for it."""
    pinned = ROOT / "requirements" / "package.txt"
    found = {}
    for version in PYTHONS:
        base = None
        if version != PYTHONS[0]:
            base = environment.interpreter(version, headers=True)
            if base is None:
                say(f"no Python {version} with headers is at hand: the Blenders that have it will "
                    "refuse this extension")  # fmt: skip
                continue
        place = ROOT / (".venv-package" + ("" if base is None else f"-{version}"))
        found[version] = environment.ensure_environment(place, pinned, base)
    return found


def _name() -> str:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    return f"selenite-{version}"


def _wheel(version: str, python: Path, prefix: Path) -> Path:
    """The wheel for one Python, named after the oldest C library that it runs with, and tried."""
    plain, scratch = WORK / "plain" / version, WORK / "opened" / version
    static = f"-Ccmake.define.SELENITE_STATIC_LIBRARIES={prefix}"
    run([python, "-m", "build", "--wheel", "--no-isolation", static, "--outdir", plain, ROOT])
    made = next(plain.glob("selenite-*.whl"))
    env = {"PATH": f"{python.parent}:{os.environ['PATH']}"}
    repair = ["-m", "auditwheel", "repair", "--plat", "auto", "--wheel-dir"]
    run([python, *repair, DIST, made], env=env)
    wheel = next(DIST.glob(f"selenite-*-{_tag(version)}-{_tag(version)}-*.whl"))
    _refuse(package_checks.faults_of_wheel(wheel, scratch))
    for module in sorted(scratch.glob("selenite/*.so")):
        needed = package_checks.newest_glibc(module)
        version = ".".join(map(str, needed))
        say(f"{module.name}: {module.stat().st_size / 1e6:.1f} MB, glibc {version} or newer")
        if needed > GLIBC:
            raise Failed(f"{module.name} needs glibc {version}: cmake/oldest_glibc.cmake lacks "
                         "a function; nm -D --undefined-only names it")  # fmt: skip
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(scratch)
    # Each module tests itself when it is loaded.
    run([python, "-c", "import selenite._core, selenite._image"], env={"PYTHONPATH": str(scratch)})
    return wheel


def _foreign_wheel(platform: cross.Platform, version: str, python: Path, prefix: Path) -> Path:
    """As `_wheel`, for a system that does not run here."""
    settings = platform.module_settings(version, prefix).items()
    defined = [f"-Ccmake.define.{name}={value}" for name, value in settings]
    # One build tree for all Pythons: what does not include Python's headers is compiled once. The
    # settings are those of this one, and scikit-build-core begins anew where it sees another's.
    tree = BUILD / f"wheel-{platform.name}"
    for name in ("CMakeCache.txt", ".skbuild-info.json"):
        (tree / name).unlink(missing_ok=True)
    defined.append(f"-Cbuild-dir={tree}")
    # What the wheel's tag is made of: Python takes it for the platform that it runs on.
    env = {"_PYTHON_HOST_PLATFORM": platform.in_python}
    command: list[str | Path] = [python, "-m", "build", "--wheel", "--no-isolation", *defined]
    run([*command, "--outdir", DIST, ROOT], env=env)
    (wheel,) = DIST.glob(f"selenite-*-{_tag(version)}-{_tag(version)}-{platform.tag}.whl")
    faults_of_module = foreign_checks.FAULTS_OF_MODULE[platform.name]
    scratch = WORK / "opened" / f"{platform.name}-{version}"
    _refuse(package_checks.faults_of_wheel(wheel, scratch, faults_of_module))
    return wheel


def _pure_python_wheels(python: Path) -> list[Path]:
    """Wheels of the run time requirements, in the versions that are tested."""
    target = WORK / "wheels"
    pins = (ROOT / "requirements" / "dev.txt").read_text().splitlines()
    wanted = [pin for pin in pins if pin.partition("==")[0] in PURE_PYTHON]
    run([python, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps",
         "--only-binary", ":all:", "--dest", target, *wanted])  # fmt: skip
    return sorted(target.glob("*.whl"))


def _sources(target: Path) -> None:
    """The add-on's own files and the demo's: no native module, no stub of one, no cache."""
    left_out = shutil.ignore_patterns("*.so", "*.pyd", "*.pyi", "*.partial", "lib", "__pycache__")
    shutil.copytree(PACKAGE, target, ignore=left_out)
    for name in package_checks.DEMO:
        (target / "demo_scene" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / "scenes" / name, target / "demo_scene" / name)
    # The guide's pages name their pictures as ../pictures, and the method as ../method.
    shutil.copytree(ROOT / "docs" / "guide", target / "manual")
    for name in ("method", "measurements"):
        shutil.copytree(ROOT / "docs" / name, target / name)
    shutil.copytree(
        ROOT / "docs" / "pictures", target / "pictures", ignore=shutil.ignore_patterns(".*")
    )
    shutil.copy2(ROOT / "LICENSE", target / "LICENSE")


def _extension(
    own: list[Path], libraries: list[Path], platform: str, result: Path, tried: str = ""
) -> Path:
    """Blender's extension in `result`, for a platform as its manifest calls it.

    `tried`: what its manifest says of a platform that it was not run on.
    """
    source = WORK / f"extension-{platform}"
    _sources(source)
    for name in ("_core", "_image"):
        (source / f"{name}.py").write_text(BRIDGE.format(name=name))
    (source / "wheels").mkdir()
    for path in [*own, *libraries]:
        shutil.copy2(path, source / "wheels" / path.name)
    listed = "".join(f'  "./wheels/{path.name}",\n' for path in [*own, *libraries])
    manifest = source / "blender_manifest.toml"
    text = manifest.read_text()
    if "wheels = []" not in text:
        raise Failed("blender_manifest.toml has no line 'wheels = []' to fill")
    lists = f'platforms = ["{platform}"]\nwheels = [\n{listed}]'
    if tried:
        lists = f"# {tried}\n{lists}"
    manifest.write_text(text.replace("wheels = []", lists))
    tool = next(
        (ROOT / ".venv").glob(
            "lib/*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
        )
    )
    run([PYTHON, tool, "validate", source])
    run([PYTHON, tool, "build", "--source-dir", source, "--output-filepath", result])
    run([PYTHON, tool, "validate", result])
    return result


def _legacy(libraries: list[Path]) -> Path:
    """Blender 3.4 knows no wheels: the modules lie in the package, pure Python in its lib/."""
    source = WORK / "legacy" / "selenite"
    _sources(source)
    for module in PACKAGE.glob("*.cpython-311-*.so"):
        shutil.copy2(module, source / module.name)
    for path in libraries:
        with zipfile.ZipFile(path) as archive:
            archive.extractall(source / "lib")
    with (source / "__init__.py").open("a") as start:
        start.write(FIND_LIB)
    result = DIST / f"{_name()}-blender34-debian.zip"
    _zip(result, [(path, path.relative_to(source.parent)) for path in sorted(source.rglob("*"))])
    return result


def _zip(target: Path, files: list[tuple[Path, Path]]) -> None:
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, name in files:
            if path.is_file():
                archive.write(path, str(name))


def _try_extension(extension: Path) -> None:
    """Installs the zip into an empty Blender home, switches it on and uses the native modules.

    Twice: as in the bpy wheel, and with Blender's libraries in the global scope, where the official
    executable has them. The second is where a module that shares a name with them breaks.
    """
    program = (
        f"import sys; sys.path = [p for p in sys.path if p != {str(PACKAGE.parent)!r}]\n"
        "import os; flags = sys.getdlopenflags() | (os.RTLD_GLOBAL if {shared} else 0)\n"
        "sys.setdlopenflags(flags); import bpy\n"
        "sys.setdlopenflags(flags & ~os.RTLD_GLOBAL)\n"
        f"bpy.ops.extensions.package_install_files(filepath={str(extension)!r},"
        " repo='user_default', enable_on_install=True)\n"
        "import importlib\n"
        "native = importlib.import_module('bl_ext.user_default.selenite.native')\n"
        "native.core(); native.image()\n"
        "print('extension works in Blender', bpy.app.version_string, {shared})\n"
        "sys.stdout.flush(); os._exit(0)\n"
    )
    for shared in ("False", "True"):
        home = WORK / "home"
        shutil.rmtree(home, ignore_errors=True)
        command: list[str | Path] = [PYTHON, "-c", program.replace("{shared}", shared)]
        if asyncio.run(run_limited(command, 600, {"BLENDER_USER_RESOURCES": str(home)})):
            raise Failed(f"the extension does not work (Blender's libraries global: {shared})")


def _try_legacy(legacy: Path) -> None:
    blender = os.environ.get("SELENITE_BLENDER34") or shutil.which("blender")
    if blender is None:
        say("no Blender 3.4 here: the legacy add-on is not tried")
        return
    program = (
        "import bpy, sys\n"
        f"bpy.ops.preferences.addon_install(filepath={str(legacy)!r})\n"
        "bpy.ops.preferences.addon_enable(module='selenite')\n"
        "from selenite import native\n"
        "native.core(); native.image()\n"
        "import rich, defusedxml, platformdirs\n"
        "print('legacy add-on works in Blender', bpy.app.version_string)\n"
    )
    command = [
        blender,
        "-b",
        "--factory-startup",
        "--python-exit-code",
        "1",
        "--python-expr",
        program,
    ]
    home = WORK / "home34"
    home.mkdir(exist_ok=True)
    env = {"BLENDER_USER_SCRIPTS": str(home), "BLENDER_USER_CONFIG": str(home)}
    if asyncio.run(run_limited(command, 600, env)):
        raise Failed("the legacy add-on does not work in Blender 3.4")
