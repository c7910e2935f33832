# SPDX-License-Identifier: GPL-3.0-or-later
"""Renames what some object files define, so that no other object has it, in an archive of copies.

Code that is compiled for a newer instruction set defines functions of headers as well. Under the
name that they have elsewhere, the linker would keep one copy for all.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--prefix", required=True, help="what the names begin with then")
    parser.add_argument("--keep", required=True, help="symbols with this text keep their names")
    parser.add_argument("--archive", type=Path, required=True)
    parser.add_argument("--tools", default="llvm-", help="what nm, objcopy and ar begin with")
    parser.add_argument("objects", nargs="+", type=Path)
    options = parser.parse_args(arguments)
    tools = options.tools
    names = sorted(set().union(*(defined(item, tools) for item in options.objects)))
    pairs = [f"{name} {options.prefix}{name}\n" for name in names if options.keep not in name]
    options.archive.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        listed = Path(scratch) / "names"
        listed.write_text("".join(pairs))
        copies = []
        for number, source in enumerate(options.objects):
            copy = Path(scratch) / f"{number}.o"
            shutil.copy2(source, copy)
            _run(f"{tools}objcopy", f"--redefine-syms={listed}", copy)
            copies.append(copy)
        _run(f"{tools}ar", "rcsD", options.archive, *copies)


def defined(objects: Path, tools: str = "llvm-") -> set[str]:
    """Names that other objects see, of an object file or an archive."""
    command = [f"{tools}nm", "--extern-only", "--defined-only", "--format=just-symbols", "--quiet"]
    listing = subprocess.run([*command, objects], capture_output=True, text=True, check=True).stdout
    return {line for line in listing.split() if not line.endswith(":")}


def _run(*command: str | Path) -> None:
    subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
