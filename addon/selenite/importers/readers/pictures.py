# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes of photos, for formats that leave them out."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from .files import Place, inside, is_file

#: Of photos and masks; in this order where a file is named without one.
SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".hdr")
#: Of photos that are not read: raw ones, and of formats that few other programs read either.
OTHER_SUFFIXES = (
    ".arw", ".avif", ".bmp", ".cr2", ".cr3", ".dng", ".heic", ".heif", ".jp2", ".jxl", ".nef",
    ".orf", ".raf", ".rw2", ".tga", ".webp",
)  # fmt: skip
#: What programs put behind a photo's name to call its mask.
MASK_ENDINGS = ("_mask", "-mask", ".mask")
CURE = "put the photos beside the file, or give their folder"


def is_picture(name: str) -> bool:
    """Whether the name is that of a photo or mask, by its ending."""
    return PurePosixPath(name).suffix.lower() in SUFFIXES


class Pictures:
    """Photos by name, in the folder of a file and in others; of each the size alone is read."""

    def __init__(self, folder: Path, folders: Iterable[Path] = ()) -> None:
        self._folders = (folder, *folders)
        self._listed: dict[Path, dict[str, Path]] = {}

    def size(self, names: Iterable[str], place: Place) -> tuple[int, int]:
        """Width and height of the first picture of these names that is found. Raises
        ReconstructionError."""
        names = [name for name in names if name]
        for name in names:
            path = self.find(name)
            if path is not None:
                return _probed(path, place)
        raise place.error("the size of its photo is not known, as it is not there", CURE)

    def find(self, name: str) -> Path | None:
        """As named below one of the folders, or there by its last part, with another or no suffix
        too."""
        name = name.replace("\\", "/")
        for folder in self._folders:
            path = inside(folder, name)
            for candidate in (path, *_with_suffixes(path)):
                if is_file(candidate):
                    return candidate
        last = PurePosixPath(name).name
        for folder in self._folders:
            known = self._files(folder)
            stem = last.rpartition(".")[0] or last
            found = known.get(last.casefold()) or known.get(stem.casefold())
            if found is not None:
                return found
        return None

    def _files(self, folder: Path) -> dict[str, Path]:
        """Pictures of a folder by name and by stem, in lower case; a mask has its photo's size and
        stands for it."""
        if folder not in self._listed:
            known: dict[str, Path] = {}
            try:
                entries = sorted(folder.iterdir())
            except (OSError, ValueError):
                entries = []
            pictures = [path for path in entries if is_picture(path.name)]
            for path in pictures:
                known.setdefault(path.name.casefold(), path)
                known.setdefault(path.stem.casefold(), path)
            for path in pictures:
                for ending in MASK_ENDINGS:
                    known.setdefault(path.stem.casefold().removesuffix(ending), path)
            self._listed[folder] = known
        return self._listed[folder]


def _with_suffixes(path: Path | None) -> list[Path]:
    """Of a name that has none of a picture."""
    if path is None or is_picture(path.name):
        return []
    return [path.with_name(path.name + suffix) for suffix in SUFFIXES]


def _probed(path: Path, place: Place) -> tuple[int, int]:
    from ... import native

    try:
        info = native.image().probe(str(path))
    except (OSError, ValueError, native.NativeUnavailable) as error:
        raise place.error(
            f"the size of its photo {path.name} cannot be read ({error})", CURE
        ) from error
    return int(info["width"]), int(info["height"])
