# SPDX-License-Identifier: GPL-3.0-or-later
"""What `./dev package` refuses of modules for Windows and macOS, by what LLVM's tools print."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import cross  # noqa: E402
import foreign_checks as checks  # noqa: E402

IMPORTS = "Format: COFF-x86-64\n" + "".join(
    f"Import {{\n  Name: {name}\n  ImportLookupTableRVA: 0x338F8\n  Symbol: abort (0)\n}}\n"
    for name in ("api-ms-win-crt-runtime-l1-1-0.dll", "KERNEL32.dll", "python311.dll")
)
EXPORTS = "Export {{\n  Ordinal: 1\n  Name: {}\n  RVA: 0x1000\n}}\n"
COMMANDS = """
 MH_MAGIC_64   ARM64        ALL  0x00       DYLIB    19       1864   NOUNDEFS
          cmd LC_LOAD_DYLIB
      cmdsize 56
         name /usr/lib/libSystem.B.dylib (offset 24)
      cmd LC_BUILD_VERSION
  platform macos
    minos {}
      cmd {}
"""
LOOKED_UP = """
                 (undefined) external _PyModule_Create2
                 (undefined) weak external __Unwind_Resume (from libSystem)
                 (undefined) external {}
"""


def listing(monkeypatch: pytest.MonkeyPatch, texts: dict[str, str]) -> None:
    """Answers by the one option that a command has of them."""

    def output(*command: str | Path) -> str:
        (found,) = (text for option, text in texts.items() if option in command)
        return found

    monkeypatch.setattr(checks, "_output", output)


@pytest.mark.parametrize(
    ("exports", "more", "fault"),
    [
        (["PyInit__core"], "", ""),
        (["PyInit__core", "_ZTVN8pybind1110cast_errorE"], "", ""),
        (["PyInit__core", "rtcNewDevice"], "", "exports PyInit__core, rtcNewDevice; it has to"),
        ([], "", "exports nothing; it has to export PyInit__core alone"),
        (["PyInit__core"], "embree4.dll", "needs embree4.dll, which a system may lack"),
        (["PyInit__core"], "libc++.dll", "needs libc++.dll"),
    ],
)
def test_a_module_for_windows_exports_its_entry_and_needs_windows_alone(
    monkeypatch: pytest.MonkeyPatch, exports: list[str], more: str, fault: str
) -> None:
    imports = IMPORTS + (f"Import {{\n  Name: {more}\n}}\n" if more else "")
    shown = "".join(EXPORTS.format(name) for name in exports)
    listing(monkeypatch, {"--coff-exports": shown, "--coff-imports": imports})
    faults = checks.faults_of_windows_module(Path("_core.cp311-win_amd64.pyd"))
    assert len(faults) == bool(fault)
    assert fault in "".join(faults)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({}, ""),
        ({"names": "_PyInit__core\n___dso_handle\n"}, ""),
        ({"names": "_PyInit__core\n__ZdlPv\n"}, "exports _PyInit__core, __ZdlPv"),
        ({"oldest": "13.0"}, "is for macOS 13.0, not 11.0"),
        ({"signature": "LC_SYMTAB"}, "is not signed"),
        ({"processor": "X86_64"}, "is not for Apple's processors"),
        ({"taken": "_rtcNewDevice"}, "takes _rtcNewDevice from whatever has it"),
    ],
)
def test_a_module_for_macos_stands_for_itself_and_names_the_oldest_that_blender_runs_on(
    monkeypatch: pytest.MonkeyPatch, changes: dict[str, str], fault: str
) -> None:
    usual = {
        "names": "_PyInit__core\n", "oldest": "11.0", "signature": "LC_CODE_SIGNATURE",
        "processor": "ARM64", "taken": "_Py_IncRef",
    }  # fmt: skip
    shown = usual | changes
    commands = COMMANDS.format(shown["oldest"], shown["signature"])
    listing(monkeypatch, {
        "--extern-only": shown["names"],
        "--macho": commands.replace("ARM64", shown["processor"]),
        "--undefined-only": LOOKED_UP.format(shown["taken"]),
    })  # fmt: skip
    faults = checks.faults_of_macos_module(Path("_core.cpython-311-darwin.so"))
    assert len(faults) == bool(fault)
    assert fault in "".join(faults)


def test_each_platform_has_a_toolchain_and_checks() -> None:
    assert cross.PLATFORMS.keys() == checks.FAULTS_OF_MODULE.keys()
    for platform in cross.PLATFORMS.values():
        text = Path(platform.cmake()["CMAKE_TOOLCHAIN_FILE"]).read_text()
        assert f'"${{SELENITE_TOOLS}}/{platform.triple}"' in text
