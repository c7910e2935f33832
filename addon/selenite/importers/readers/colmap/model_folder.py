# SPDX-License-Identifier: GPL-3.0-or-later
"""A folder with a COLMAP model, in text or binary."""

from __future__ import annotations

from pathlib import Path

from ...reconstruction import Reconstruction
from ..files import Place, is_file
from .binary import read_binary_model
from .model import Model
from .text import read_text_model

#: Where a model lies below the folder of a project.
PLACES = ("", "sparse/0", "sparse", "0")


def model_folder(folder: Path) -> Path | None:
    """The folder itself or the usual one in it, if a model is there."""
    for place in PLACES:
        found = folder / place
        if any(is_file(found / f"cameras{suffix}") for suffix in (".bin", ".txt")):
            return found
    return None


def read_colmap(folder: Path, name: str) -> Reconstruction:
    """Binary files come before text, as in COLMAP. Raises ReconstructionError."""
    suffix = ".bin" if is_file(folder / "cameras.bin") else ".txt"
    if not is_file(folder / f"images{suffix}"):
        raise Place(folder, f"images{suffix}").error("it is missing", "give a whole COLMAP model")
    model = Model(folder)
    others = _other_models(folder)
    if others:
        model.remarks.append(f"other models of it are not read: {others}")
    (read_binary_model if suffix == ".bin" else read_text_model)(folder, model)
    return model.reconstruction(name)


def _other_models(folder: Path) -> str:
    """Of parts of a project that COLMAP could not join: 1, 2 and so on beside the folder 0."""
    if folder.name != "0":
        return ""
    siblings = (folder.parent / str(number) for number in range(1, 100))
    return ", ".join(one.name for one in siblings if model_folder(one) == one)
