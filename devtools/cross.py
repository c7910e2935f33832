# SPDX-License-Identifier: GPL-3.0-or-later
"""The clang of ziglang, with which modules for Windows and macOS are made on Linux.

It brings headers and libraries of both systems along, and builds its runtime when something is
linked for the first time. That takes minutes, so its cache lies outside the checkout.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import zipfile
from dataclasses import dataclass
from pathlib import Path

import environment
from process import ROOT, Failed, is_stamped, run, say, write_if_other, write_stamp

CACHE = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "selenite"
REQUIREMENTS = ROOT / "requirements" / "cross.txt"
TOOLS = CACHE / "cross" / "bin"


@dataclass(frozen=True)
class Platform:
    """A system that is built for and does not run here."""

    name: str
    #: How clang names it, and how configure scripts do
    triple: str
    host: str
    #: Instructions that every processor of it has; empty: the compiler's own idea of that
    processor: str
    #: Of wheels: its tag, and what native modules end in
    tag: str
    suffix: str
    #: As Python calls it in sysconfig, and Blender in a manifest
    in_python: str
    in_blender: str
    #: What has been seen of its modules
    tried: str

    def tool(self, name: str) -> Path:
        return TOOLS / f"{self.triple}-{name}"

    def cmake(self) -> dict[str, str]:
        """What every project is configured with."""
        toolchain = ROOT / "cmake" / f"{self.name}.cmake"
        return {"CMAKE_TOOLCHAIN_FILE": str(toolchain), "SELENITE_TOOLS": str(TOOLS)}

    def module_settings(self, version: str, prefix: Path) -> dict[str, str]:
        """What Selenite is configured with, for a Python and with static libraries in `prefix`."""
        compact = version.replace(".", "")
        settings = {
            **self.cmake(),
            "SELENITE_STATIC_LIBRARIES": str(prefix),
            "CMAKE_PREFIX_PATH": str(prefix),
            "CMAKE_FIND_ROOT_PATH": str(prefix),
            "Eigen3_DIR": "/usr/share/eigen3/cmake",
            "PYTHON_MODULE_DEBUG_POSTFIX": "",
            "PYTHON_MODULE_EXTENSION": self.suffix.format(compact),
            "SELENITE_WERROR": "ON" if os.environ.get("CI") else "OFF",
        }
        place = foreign_python(self, version)
        if self is WINDOWS:
            settings |= {
                "Python_INCLUDE_DIR": str(place / "include"),
                "Python_LIBRARY": str(place / "libs" / f"python{compact}.lib"),
            }
        else:
            settings["Python_INCLUDE_DIR"] = str(place / "include" / f"python{version}")
        return settings


WINDOWS = Platform(
    "windows", "x86_64-windows-gnu", "x86_64-w64-mingw32", "x86_64_v2",
    "win_amd64", ".cp{}-win_amd64.pyd", "win-amd64", "windows-x64",
    "Built on Linux, tried under Wine, never run on Windows.",
)  # fmt: skip
MACOS = Platform(
    "macos", "aarch64-macos.11.0-none", "aarch64-apple-darwin", "",
    "macosx_11_0_arm64", ".cpython-{}-darwin.so", "macosx-11.0-arm64", "macos-arm64",
    "Built on Linux, never run.",
)  # fmt: skip
# Their Pythons as Maven Central has them: version -> artifact and its SHA-256. Of macOS headers are
# taken alone; for 3.11 it has Intel's, which tell processors apart by the compiler.
PYTHONS = {
    "windows": {
        "3.11": (
            "org.bytedeco:cpython:3.11.3-1.5.9:jar:windows-x86_64",
            "3263a50b256447bb7b9e604d6587627e419891370fc33b94469e6a06ff4de834",
        ),
        "3.13": (
            "org.bytedeco:cpython:3.13.5-1.5.12:jar:windows-x86_64",
            "cfe5502ffa7ea369be707b6d88bf68344732a7800450665080fb4267c01bfeae",
        ),
    },
    "macos": {
        "3.11": (
            "org.bytedeco:cpython:3.11.3-1.5.9:jar:macosx-x86_64",
            "223aed1538351b9df68781f60afa865c5ca6cc640353cb5d46b4706049cec5e4",
        ),
        "3.13": (
            "org.bytedeco:cpython:3.13.5-1.5.12:jar:macosx-arm64",
            "b9ccb29cafe9c0f9bf341fa1573ac0f112d3557c13c398115ab91926091fdc0a",
        ),
    },
}
PLATFORMS = {platform.name: platform for platform in (WINDOWS, MACOS)}


def ensure(platform: Platform) -> None:
    """Installs the compiler and writes its programs under the names that CMake asks for."""
    python = environment.ensure_environment(CACHE / "cross" / "ziglang", REQUIREMENTS)
    (zig,) = python.parent.parent.glob("lib/*/site-packages/ziglang/zig")
    TOOLS.mkdir(parents=True, exist_ok=True)
    target = f"-target {platform.triple}"
    if platform.processor:
        target += f" -mcpu={platform.processor}"
    programs = {"clang": f"cc {target}", "clang++": f"c++ {target}"}
    for name, words in {**programs, **{n: n for n in ("ar", "ranlib", "rc")}}.items():
        tool = platform.tool(name)
        write_if_other(
            tool,
            "#!/bin/sh\n"
            f"export ZIG_GLOBAL_CACHE_DIR='{CACHE / 'cross' / 'zig'}'\n"
            f"exec '{zig}' {words} \"$@\"\n",
        )
        tool.chmod(0o755)


def foreign_python(platform: Platform, version: str) -> Path:
    """The folder of a platform's Python: of Windows python.exe, include/, libs/."""
    artifact, checksum = PYTHONS[platform.name][version]
    _, name, number, _, classifier = artifact.split(":")
    target = (
        CACHE / "cross" / f"python-{version}{'' if platform is WINDOWS else '-' + platform.name}"
    )
    stamp = target.with_name(f"{target.name}.stamp")
    if not is_stamped(stamp, checksum):
        say(f"fetching Python {version} for {classifier}")
        jars = CACHE / "cross" / "jars"
        run(["mvn", "--quiet", "--batch-mode", "dependency:copy", f"-Dartifact={artifact}",
             f"-DoutputDirectory={jars}"])  # fmt: skip
        jar = jars / f"{name}-{number}-{classifier}.jar"
        if hashlib.sha256(jar.read_bytes()).hexdigest() != checksum:
            raise Failed(f"{jar} is not the file of the checksum in devtools/cross.py")
        shutil.rmtree(target, ignore_errors=True)
        with zipfile.ZipFile(jar) as archive:
            archive.extractall(target)
        write_stamp(stamp, checksum)
    return target / "org" / "bytedeco" / name / classifier


def compiler() -> str:
    """What results depend on."""
    return REQUIREMENTS.read_text()
