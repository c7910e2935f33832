# SPDX-License-Identifier: GPL-3.0-or-later
"""Code for a newer processor keeps its copies of shared functions to itself."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "devtools"))

import isolate  # noqa: E402

compiled = pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler")
HEADER = (
    "__attribute__((noinline)) inline int which() { static int found = WHICH; return found; }\n"
)
ENTRY = HEADER + "int entry() { return which(); }\n"
PROGRAM = (
    "#include <cstdio>\n" + HEADER + "int entry();\n"
    'int main() { std::printf("%d %d", which(), entry()); }\n'
)


def compiled_object(folder: Path, name: str, text: str, which: int) -> Path:
    source = folder / f"{name}.cpp"
    source.write_text(text)
    target = source.with_suffix(".o")
    subprocess.run(["c++", "-O1", f"-DWHICH={which}", "-c", source, "-o", target], check=True)
    return target


def output_of(*objects: Path) -> str:
    program = objects[0].with_suffix(".program")
    subprocess.run(["c++", *objects, "-o", program], check=True)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout


@compiled
def test_each_side_has_its_own_copy_of_an_inline_function(tmp_path: Path) -> None:
    program = compiled_object(tmp_path, "program", PROGRAM, 1)
    newer = compiled_object(tmp_path, "newer", ENTRY, 2)
    assert output_of(program, newer) == "1 1", "the linker keeps one copy"
    archive = tmp_path / "libnewer.a"
    isolate.main(["--prefix=new_", "--keep=entry", "--tools=", f"--archive={archive}", str(newer)])
    assert output_of(program, archive) == "1 2"
    shared = isolate.defined(archive, "") & isolate.defined(program, "")
    assert not shared
    assert [name for name in isolate.defined(archive, "") if not name.startswith("new_")] == [
        "_Z5entryv"
    ]
