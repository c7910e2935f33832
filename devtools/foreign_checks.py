# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to hold for a native module of Windows or macOS, as far as its file tells."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

# Of Windows 10 and later, and Python. All else is inside the module.
WINDOWS_LIBRARIES = re.compile(
    r"(kernel32|advapi32|shell32|user32|ole32|ws2_32|psapi|bcrypt|ntdll|python3\d*)\.dll"
    r"|api-ms-win-(crt|core)-[\w-]+\.dll",
    re.IGNORECASE,
)
MACOS_LIBRARIES = re.compile(r"/usr/lib/lib(System\.B|c\+\+\.1|c\+\+abi)\.dylib")
# Every library that zig links shows these; other libraries have their own.
OF_ZIG = {"___dso_handle", "__mh_dylib_header"}
OLDEST_MACOS = "11.0"  # Blender's own minimum


def faults_of_windows_module(module: Path) -> list[str]:
    """Why a .pyd may share names with Blender's libraries or lack one, each as a sentence."""
    names = re.compile(r"^  Name: (\S+)", re.MULTILINE)
    exported = set(names.findall(_output("llvm-readobj", "--coff-exports", module)))
    needed = set(names.findall(_output("llvm-readobj", "--coff-imports", module)))
    # pybind11 marks two classes of exceptions; a DLL takes names from those alone that it names.
    own = {name for name in exported if "8pybind11" not in name}
    faults = _faults_of_exports(module, own, f"PyInit_{_name(module)}")
    if others := sorted(name for name in needed if not WINDOWS_LIBRARIES.fullmatch(name)):
        faults.append(f"{module.name} needs {', '.join(others)}, which a system may lack")
    return faults


def faults_of_macos_module(module: Path) -> list[str]:
    """The same of a module for macOS, its processor, and the oldest macOS that it names."""
    names = _output("llvm-nm", "--extern-only", "--defined-only", "--format=just-symbols", module)
    own = {name for name in names.split() if name not in OF_ZIG and "8pybind11" not in name}
    faults = _faults_of_exports(module, own, f"_PyInit_{_name(module)}")
    commands = _output("llvm-objdump", "--macho", "--private-headers", module)
    needed = set(re.findall(r"LC_LOAD_DYLIB\s+cmdsize \d+\s+name (\S+)", commands))
    if others := sorted(name for name in needed if not MACOS_LIBRARIES.fullmatch(name)):
        faults.append(f"{module.name} needs {', '.join(others)}, which a system may lack")
    if not re.search(r"^ *MH_MAGIC_64 +ARM64 ", commands, re.MULTILINE):
        faults.append(f"{module.name} is not for Apple's processors")
    if "LC_CODE_SIGNATURE" not in commands:
        faults.append(f"{module.name} is not signed; macOS ends a process that loads it")
    oldest = set(re.findall(r"minos (\S+)", commands))
    if oldest != {OLDEST_MACOS}:
        faults.append(f"{module.name} is for macOS {', '.join(oldest)}, not {OLDEST_MACOS}")
    looked_up = _output("llvm-nm", "--undefined-only", "--format=darwin", module)
    anywhere = re.findall(r"external (\S+)(?! \(from )(?:\s|$)", looked_up)
    if wanted := sorted(name for name in anywhere if not re.match("__?Py", name)):
        faults.append(f"{module.name} takes {', '.join(wanted[:4])} from whatever has it")
    return faults


FAULTS_OF_MODULE = {"windows": faults_of_windows_module, "macos": faults_of_macos_module}


def _name(module: Path) -> str:
    return module.name.partition(".")[0]


def _faults_of_exports(module: Path, exported: set[str], entry: str) -> list[str]:
    if exported == {entry}:
        return []
    some = ", ".join(sorted(exported)[:4]) or "nothing"
    return [f"{module.name} exports {some}; it has to export {entry} alone"]


def _output(*command: str | Path) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
