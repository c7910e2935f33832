# SPDX-License-Identifier: GPL-3.0-or-later
"""The clang of ziglang, with which modules for Windows and macOS are made on Linux.

It brings headers and libraries of both systems along, and builds its runtime when something is
linked for the first time. That takes minutes, so its cache lies outside the checkout.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import environment
from process import ROOT, write_if_other

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
    #: Instructions that every processor of it has
    processor: str
    #: Of wheels: its tag, and what native modules end in
    tag: str
    suffix: str
    #: As CMake's toolchain file calls it
    toolchain: Path

    def tool(self, name: str) -> Path:
        return TOOLS / f"{self.triple}-{name}"

    def cmake(self) -> dict[str, str]:
        return {"CMAKE_TOOLCHAIN_FILE": str(self.toolchain), "SELENITE_TOOLS": str(TOOLS)}


WINDOWS = Platform(
    "windows", "x86_64-windows-gnu", "x86_64-w64-mingw32", "x86_64_v2", "win_amd64", ".pyd",
    ROOT / "cmake" / "windows.cmake",
)  # fmt: skip
MACOS = Platform(
    "macos", "aarch64-macos.11.0-none", "aarch64-apple-darwin", "apple_m1", "macosx_11_0_arm64",
    ".so", ROOT / "cmake" / "macos.cmake",
)  # fmt: skip
PLATFORMS = {platform.name: platform for platform in (WINDOWS, MACOS)}


def ensure(platform: Platform) -> None:
    """Installs the compiler and writes its programs under the names that CMake asks for."""
    python = environment.ensure_environment(CACHE / "cross" / "ziglang", REQUIREMENTS)
    (zig,) = python.parent.parent.glob("lib/*/site-packages/ziglang/zig")
    TOOLS.mkdir(parents=True, exist_ok=True)
    target = f"-target {platform.triple} -mcpu={platform.processor}"
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


def compiler() -> str:
    """What results depend on."""
    return REQUIREMENTS.read_text()
