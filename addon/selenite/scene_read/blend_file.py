# SPDX-License-Identifier: GPL-3.0-or-later
"""Opening a .blend file, and what is to be known of it as a whole."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy

from ..messages import thing
from ..paths import why_not_output
from ..problems import BadInput, NotWritten, Problem

#: The last block's header, with a margin; how compressed files begin and end.
_TAIL = 64
_ZSTD, _SEEKABLE = b"\x28\xb5\x2f\xfd", b"\xb1\xea\x92\x8f"
_ROOM = "see that its disk or quota has room, and save again"
_CURE = "bake it to keyframes, or write an expression of numbers and variables alone"


def open_blend(path: str, *, scripts: bool = False) -> bpy.types.Scene:
    """Opens a .blend file in this process and returns its scene. Raises BadInput.

    scripts: whether its Python runs (drivers, texts): only for a copy of a file whose runs."""
    cure = "give the path of a .blend file that this Blender can read"
    title = thing("File", path)
    try:
        bpy.ops.wm.open_mainfile(filepath=path, load_ui=False, use_scripts=scripts)
    except RuntimeError as error:
        cause = str(error).removeprefix("Error: ").strip()
        raise BadInput(Problem(title, f"cannot be opened ({cause})", cure)) from error
    scene: bpy.types.Scene | None = bpy.context.scene
    if scene is None or bpy.context.view_layer is None:
        raise BadInput(Problem(title, "it has no scene", cure))
    return scene


def write_blend_copy(path: str, cure: str) -> None:
    """Saves the open file under another name; it keeps its own. Raises BadInput, with that cure,
    and NotWritten where the disk takes no more."""
    with whole_blend(path, cure):
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)


@contextmanager
def whole_blend(path: str, cure: str) -> Iterator[None]:
    """Around a save to `path`. Raises BadInput where the file cannot be written, and NotWritten
    where it is not whole after all: a disk or a quota is full."""
    why = why_not_output(Path(path))
    try:
        yield
    except RuntimeError as error:
        cause = " ".join(str(error).removeprefix("Error: ").split())
        title, cause = thing("File", path), f"cannot be written ({cause})"
        if why:
            raise BadInput(Problem(title, cause, cure)) from error
        raise NotWritten(Problem(title, cause, _ROOM)) from error
    if not _is_whole(Path(path)):
        raise NotWritten(Problem(thing("File", path), "it is written in part only", _ROOM))


def _is_whole(path: Path) -> bool:
    """Whether it ends as a .blend ends: with the block ENDB, or where it is compressed with the
    magic number of the table of its frames."""
    try:
        with path.open("rb") as file:
            start = file.read(7)
            size = file.seek(0, os.SEEK_END)
            file.seek(-min(size, _TAIL), os.SEEK_END)
            tail = file.read()
    except OSError:
        return False
    if start == b"BLENDER":
        return b"ENDB" in tail
    return not start.startswith(_ZSTD) or tail.endswith(_SEEKABLE)


def warnings_of_file() -> list[str]:
    """What is to be known of the open file as a whole."""
    saved = tuple(bpy.data.version)
    if saved[:2] <= bpy.app.version[:2]:
        return []
    newer, own = (".".join(map(str, version[:2])) for version in (saved, bpy.app.version))
    return [
        f"File '{bpy.data.filepath}': Blender {newer} has saved it and this is {own}, which may "
        f"read it in part only; use Blender {newer}"
    ]


def blocked_drivers() -> list[str]:
    """A sentence for each driver whose expression is Python and did not run, so that what it drives
    has the value that the file was saved with."""
    if bpy.context.preferences.filepaths.use_scripts_auto_execute and not bpy.app.autoexec_fail:
        return []
    return [
        f"{kind} '{block.name}': the driver of '{curve.data_path}' has the Python expression "
        f"'{curve.driver.expression}', which is not run; its saved value counts; {_CURE}"
        for kind, block in _blocks()
        for curve in (block.animation_data.drivers if block.animation_data else ())
        if curve.driver.type == "SCRIPTED" and not curve.driver.is_simple_expression
    ]


def _blocks() -> Iterator[tuple[str, bpy.types.ID]]:
    """Every datablock that may have drivers, with its kind; node trees and shape keys with those
    that own them."""
    for name in dir(bpy.data):
        collection = getattr(bpy.data, name)
        if not isinstance(collection, bpy.types.bpy_prop_collection):
            continue
        for block in collection:
            kind = block.bl_rna.name
            for item in (
                block,
                getattr(block, "node_tree", None),
                getattr(block, "shape_keys", None),
            ):
                if item is not None and hasattr(item, "animation_data"):
                    yield kind, item
