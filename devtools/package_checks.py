# SPDX-License-Identifier: GPL-3.0-or-later
"""What has to hold for a package before it may be called one: its contents, size and symbols."""

from __future__ import annotations

import re
import subprocess
import tomllib
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

LARGEST_EXTENSION = 40_000_000  # bytes

# The C library and the compiler's unwinder, which every Blender and Python has loaded before. All
# else is inside the module.
SYSTEM_LIBRARIES = {
    "libgcc_s.so.1",
    "libc.so.6",
    "libm.so.6",
    "libmvec.so.1",  # of the C library, too: sine, cosine, exp and log of eight numbers at once
    "libpthread.so.0",
    "libdl.so.2",
    "librt.so.1",
    "ld-linux-x86-64.so.2",
}
DEMO = ("example_scene.py", "jade_pendant.py", "jade_pendant/Front.png", "jade_pendant/Side.png",
        "jade_pendant/blender_3/Front.png", "jade_pendant/blender_3/Side.png",
        "jade_pendant/truth.json")  # fmt: skip
IN_WHEEL = ("__init__.py", "cli.py", "interface/__init__.py", *(f"demo_scene/{x}" for x in DEMO))


def faults_of_module(module: Path) -> list[str]:
    """Why a native module may clash with Blender's libraries or lack one, each as a sentence.

    Official Blender exports its own Embree, OpenImageIO and OpenEXR to every module it loads. A
    module is safe from them if it takes nothing by name but Python's and the C library's functions.
    """
    name = module.name.partition(".")[0]
    faults = []
    exported = {symbol for symbol, _ in _symbols(module, "--defined-only")}
    if extra := sorted(exported - {f"PyInit_{name}"}):
        faults.append(f"{module.name} exports {_some(extra)}; it may export PyInit_{name} alone")
    wanted = [
        symbol
        for symbol, kind in _symbols(module, "--undefined-only")
        if "@" not in symbol and kind not in "wvV" and not re.match(r"_?Py", symbol)
    ]
    if wanted:
        faults.append(f"{module.name} takes {_some(sorted(wanted))} from whatever has it")
    listing = _output(["readelf", "--dynamic", "--wide", module])
    needed = set(re.findall(r"\(NEEDED\).*\[(.+?)\]", listing))
    if others := sorted(needed - SYSTEM_LIBRARIES):
        faults.append(f"{module.name} needs {', '.join(others)}, which a system may lack")
    return faults


def faults_of_wheel(
    wheel: Path,
    scratch: Path,
    faults_of_module: Callable[[Path], list[str]] = faults_of_module,
) -> list[str]:
    """The same of a wheel: its contents, and its modules, which are unpacked into `scratch`."""
    faults = []
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        missing = [f"selenite/{name}" for name in IN_WHEEL if f"selenite/{name}" not in names]
        if missing:
            faults.append(f"{wheel.name} lacks {', '.join(missing)}")
        native = [name for name in names if re.search(r"\.(so|pyd|dll|dylib)\b", name)]
        if extra := [name for name in native if not name.startswith("selenite/_")]:
            faults.append(f"{wheel.name} carries {_some(sorted(extra))}")
        tag = wheel.name.split("-")[2]
        for module in ("_core", "_image"):
            wanted = rf"selenite/{module}\.(cpython-|cp){tag[2:]}-.*\.(so|pyd)"
            found = [name for name in native if re.match(wanted, name)]
            if not found:
                faults.append(f"{wheel.name} lacks the module {module} for {tag}")
            for name in found:
                faults += faults_of_module(Path(archive.extract(name, scratch)))
    return faults


def faults_of_extension(extension: Path, tags: Iterable[str]) -> list[str]:
    """Of Blender's extension: `tags` are the Pythons it has to serve, such as cp311."""
    size = extension.stat().st_size
    faults = []
    if size >= LARGEST_EXTENSION:
        most = LARGEST_EXTENSION / 1e6
        faults.append(f"{extension.name} has {size / 1e6:.1f} MB; it may have less than {most:.0f}")
    with zipfile.ZipFile(extension) as archive:
        names = set(archive.namelist())
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    listed = {name.removeprefix("./") for name in manifest["wheels"]}
    wheels = {name for name in names if name.endswith(".whl")}
    if listed != wheels:
        faults.append(
            f"{extension.name} lists {_some(sorted(listed))}, has {_some(sorted(wheels))}"
        )
    for tag in tags:
        if not any(Path(name).name.split("-")[2:3] == [tag] for name in wheels):
            faults.append(f"{extension.name} has no wheel of Selenite for {tag}")
    if loose := [name for name in names if name.endswith((".so", ".pyd"))]:
        faults.append(f"{extension.name} carries {_some(sorted(loose))} outside a wheel")
    if missing := [name for name in ("__init__.py", "LICENSE") if name not in names]:
        faults.append(f"{extension.name} lacks {', '.join(missing)}")
    return faults


def newest_glibc(module: Path) -> tuple[int, ...]:
    """The oldest glibc that has every function the module takes from it, such as (2, 35)."""
    versions = re.findall(r"@GLIBC_([0-9.]+)", _output(["nm", "-D", "--undefined-only", module]))
    return max((tuple(map(int, version.split("."))) for version in versions), default=(0,))


def _symbols(module: Path, which: str) -> list[tuple[str, str]]:
    """(name with its version, kind) of the dynamic symbols."""
    lines = _output(["nm", "-D", which, "--format=posix", module]).splitlines()
    return [(words[0], words[1]) for words in map(str.split, lines)]


def _output(command: list[str | Path]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def _some(names: list[str], most: int = 4) -> str:
    rest = len(names) - most
    return ", ".join(names[:most]) + (f" and {rest} more" if rest > 0 else "") or "nothing"
