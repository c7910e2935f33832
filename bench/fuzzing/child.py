# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads mutated files one after another: child.py KIND FOLDER FIRST SECONDS MODULE.so ...

The case that is read lies in FOLDER/case, the number of cases in FOLDER/progress. An exception that
no user should see ends the process, as a crash of the native code does.
"""

from __future__ import annotations

import importlib.util
import os
import random
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "addon"), str(ROOT / "bench")]

from fuzzing.mutation import mutated  # noqa: E402


def load(path: str) -> None:
    """A native module of another build, under the name that the add-on imports."""
    name = "selenite." + Path(path).name.partition(".")[0]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise SystemExit(f"{path} is no module")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)


def read_photo(case: Path, mask: Path | None = None) -> bool:
    """As a fit reads it, for a camera of its size."""
    from selenite import native
    from selenite.capture.prepared import read_captures
    from selenite.capture.request import CaptureRequest

    try:
        info = native.image().probe(str(case))
        size = info["width"], info["height"]
    except OSError:
        size = 1, 1
    camera = SimpleNamespace(name="Camera", width=size[0], height=size[1], aspect=size[0] / size[1])
    scene = SimpleNamespace(cameras=[camera], unusable_cameras={})
    problems: list = []
    request = CaptureRequest("Camera", str(case), "" if mask is None else str(mask))
    found = read_captures(scene, [request], 8, problems, [], {})
    return bool(found)


def read_texture(case: Path) -> bool:
    from selenite import native

    try:
        pixels, _, about = native.image().read(str(case))
    except OSError:
        return False
    if not about["float"]:
        native.image().srgb_encode(pixels)
    return True


def read_grid(case: Path) -> bool:
    from selenite import grid_files
    from selenite.problems import BadInput

    try:
        grid_files.read(str(case))
    except BadInput:
        return False
    return True


def read_checkpoint(case: Path) -> bool:
    from selenite.fit import checkpoint
    from selenite.problems import BadInput

    try:
        checkpoint.load(case)
    except BadInput:
        return False
    return True


def read_reconstruction(case: Path) -> bool:
    from fuzzing.reconstruction_seeds import paths
    from selenite.importers import read
    from selenite.importers.reconstruction import ReconstructionError

    folder = case.parent
    try:
        read.read_reconstruction(*paths(folder))
    except ReconstructionError:
        return False
    return True


def folders_of(kind: str, seeds: list[Path], place: Path) -> list[Path]:
    """Kinds of which a case is a folder: all of it lies in `place`, with one file broken."""
    if kind == "checkpoints":
        shutil.copytree(seeds[0], place, dirs_exist_ok=True)
        return sorted(place.iterdir())
    if kind == "reconstructions":
        shutil.copytree(seeds[0].parent, place, dirs_exist_ok=True)
        # Pictures are a kind of their own.
        return sorted(path for path in place.rglob("*.*") if path.suffix != ".png")
    return []


def main(kind: str, folder: Path, first: int, seconds: float) -> None:
    seeds = sorted((folder / "seeds").iterdir())
    place = folder / "case"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir()
    readers: dict[str, Callable[[Path], bool]] = {
        "photos": read_photo,
        "masks": lambda path: read_photo(folder / "seeds" / "mask.png", path),
        "textures": read_texture,
        "grids": read_grid,
        "checkpoints": lambda path: read_checkpoint(path.parent),
        "reconstructions": read_reconstruction,
    }
    whole = folders_of(kind, seeds, place)
    seeds = whole or seeds
    contents = {path: path.read_bytes() for path in seeds}
    progress = os.open(folder / "progress", os.O_CREAT | os.O_RDWR)
    counts = {True: 0, False: 0}
    end = time.time() + seconds
    number = first
    while time.time() < end:
        rng = random.Random(number)
        seed = rng.choice(seeds)
        path = seed if whole else place / seed.name
        os.pwrite(progress, f"{number} {counts[True]} {counts[False]} ".encode(), 0)
        path.write_bytes(mutated(contents[seed], contents[rng.choice(seeds)], rng))
        counts[readers[kind](path)] += 1
        if whole:
            path.write_bytes(contents[seed])
        else:
            path.unlink()
        number += 1
    os.pwrite(progress, f"{number} {counts[True]} {counts[False]} ".encode(), 0)


if __name__ == "__main__":
    for module in sys.argv[5:]:
        load(module)
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]))
