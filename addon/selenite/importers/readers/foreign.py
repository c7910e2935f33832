# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of programs that are not read: whose they are and what to give instead, in words."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path

from ..reconstruction import ReconstructionError
from .files import Place

_OTHER = "export it as COLMAP, Bundler, transforms.json or Metashape's XML"
_MESH = "export the mesh as OBJ, PLY, X3D or glTF"
_PROJECT = "open it and use File > Export > Export Cameras"
_SCENE = "it is a scene already: run 'selenite check' and 'selenite fit' with it"
#: Roots of the doc.xml in the archives of a project: of all, of a chunk, of its frame.
_PARTS = (b"<chunks ", b"<chunk version", b"<frame version")
#: What stands near the beginning of a file, whose that is, and the cure.
_CONTENTS = (
    (b'"sfm_data_version"', "OpenMVG", _OTHER),
    (b'"featuresFolders"', "AliceVision", _OTHER),
    (b'"pipelineVersion"', "Meshroom", _OTHER),
    (b'"application/opf', "Pix4D (OPF)", _OTHER),
    (b'"PinholeCamera', "Open3D", _OTHER),
    (b'"shots"', "OpenSfM", _OTHER),
    (b'"img_name"', "Gaussian splatting", "give the COLMAP model that it was trained with"),
    (
        b'"t_00"',
        "Polycam",
        "convert its folder with 'ns-process-data polycam' and give transforms.json",
    ),
    (b"<BlocksExchange", "ContextCapture", _OTHER),
    (b".files/project.zip", "a project of Metashape", _PROJECT),
    *((root, "a part of a project of Metashape", _PROJECT) for root in _PARTS),
)
#: What a file begins with.
_STARTS = (
    (b"NVM_V3", "VisualSFM (NVM)", _OTHER),
    (b"Kaydara FBX", "FBX", _MESH),
    (b"; FBX", "FBX", _MESH),
    (b"Ogawa", "Alembic", _MESH),
    (b"PXR-USDC", "USD", _MESH),
    (b"BLENDER", "a Blender file", _SCENE),
    (b"#usda", "USD", _MESH),
)
_SUFFIXES = {
    ".stl": ("STL", _MESH),
    ".psz": ("a project of Metashape", _PROJECT),
    ".usdz": ("USD", _MESH),
    ".blend": ("a Blender file", _SCENE),  # which may be compressed
}
_ARCHIVE = b"PK\x03\x04"


#: Endings of files that are tried where a folder holds nothing else, and how many at most.
_TRIED = frozenset((".json", ".sfm", ".opf", ".nvm", ".xml", ".psx", ".psz", ".mg"))
_MOST_FILES = 50
#: Folders of Polycam's raw data.
_POLYCAM = ("keyframes/corrected_cameras", "keyframes/cameras")


def error_of(file: Path, start: bytes) -> ReconstructionError | None:
    """What to raise for a file of another program; None if it is not known either. start: its
    first bytes."""
    found = next((row[1:] for row in _STARTS if start.startswith(row[0])), None)
    found = found or _SUFFIXES.get(file.suffix.lower())
    if found is None and b'"frames"' not in start:  # NeRF's may hold anything
        found = next((row[1:] for row in _CONTENTS if row[0] in start), None)
    if found is None and start.startswith(_ARCHIVE):
        found = "an archive", "unpack it and give the file inside"
    if found is None:
        return None
    return Place(file, "file").error(f"it is of a kind that is not read: {found[0]}", found[1])


def error_of_folder(folder: Path, entries: Sequence[Path]) -> ReconstructionError | None:
    """The same of a folder that holds no reconstruction of a kind that is read."""
    for name in _POLYCAM:
        inner = sorted((folder / name).glob("*.json"))[:1]
        entries = [*inner, *entries]
    tried = (path for path in entries if path.suffix.lower() in _TRIED)
    for path in islice(tried, _MOST_FILES):
        try:
            with path.open("rb") as stream:
                found = error_of(path, stream.read(1 << 16).lstrip())
        except OSError:
            continue
        if found is not None:
            return found
    return None
