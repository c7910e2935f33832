# SPDX-License-Identifier: GPL-3.0-or-later
"""Which file of a folder is the photo, or the mask, of a camera: by label, whatever the case."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ..problems import Problem, listed
from .readers.files import inside, is_file
from .readers.pictures import MASK_ENDINGS, OTHER_SUFFIXES, SUFFIXES, is_picture
from .reconstruction import ReconstructedCamera

_MOST_FILES = 200_000
#: Endings that a label may have: its photo may have been converted.
_ENDINGS = (*SUFFIXES, *OTHER_SUFFIXES)


@dataclass(frozen=True)
class FolderMatch:
    """files: by the camera's label. without: labels of cameras that have none. left: files that
    belong to no camera, relative to the folder. unread: those of kinds that are not read."""

    files: dict[str, Path]
    without: tuple[str, ...]
    left: tuple[str, ...]
    unread: tuple[str, ...]


def match_photos(
    cameras: Sequence[ReconstructedCamera], folder: Path, problems: list[Problem]
) -> FolderMatch:
    """Photos in `folder` and the folders inside it.

    A camera names its photo by a path or a label, with or without ending. The most exact match
    counts: the same name, most folders, the same ending. Two files that match equally well are a
    problem.
    """
    wanted = {item.label: [item.photo, item.label] for item in cameras}
    return _match(wanted, folder, "Photo", "--photos", problems, is_mask=False)


def match_masks(
    cameras: Sequence[ReconstructedCamera],
    folder: Path,
    problems: list[Problem],
    photos: Collection[Path] = (),
) -> FolderMatch:
    """The same of masks, which are called as the photo is, or as photo.jpg.png or photo_mask.
    photos: files that are no masks."""
    wanted = {item.label: [item.mask, item.photo, item.label] for item in cameras}
    return _match(wanted, folder, "Mask", "--masks", problems, is_mask=True, others=photos)


def masks_among(cameras: Sequence[ReconstructedCamera], files: Sequence[str]) -> list[str]:
    """Those of the files that are called as masks of photos, or lie in a folder that is."""
    wanted = {_stem(_folded(name)) for item in cameras for name in (item.photo, item.label)}
    return [file for file in files if _is_called_mask(file) and wanted & _answers_to(file, True)]


def _is_called_mask(file: str) -> bool:
    *folders, name = _folded(file).split("/")
    stem = _without_ending(name)
    is_double = _without_ending(stem) != stem  # photo.jpg.png
    return is_double or stem.endswith(MASK_ENDINGS) or any("mask" in one for one in folders)


def files_by_path(names: dict[str, str], folder: Path) -> dict[str, Path]:
    """Pictures that the file itself names, by the camera's label, where they lie in its folder or
    inside, or in the folder `images` there, as COLMAP names them: no path leads out of it. names:
    by label, "" for none."""
    found = {}
    for label, text in names.items():
        name = text.replace("\\", "/")
        places = [
            f"{start}{name}{ending}" for start in ("", "images/") for ending in ("", *SUFFIXES)
        ]
        for place in places if name else ():
            path = inside(folder, place)
            if path is not None and is_picture(path.name) and is_file(path):
                found[label] = path
                break
    return found


def short_name(label: str) -> str:
    """What a camera's object is called: the label without folders and a picture's ending."""
    name = PurePosixPath(label.replace("\\", "/")).name or label
    stem, dot, ending = name.rpartition(".")
    return stem if dot and stem and f".{ending.lower()}" in _ENDINGS else name


def _match(
    wanted: dict[str, list[str]],
    folder: Path,
    kind: str,
    argument: str,
    problems: list[Problem],
    *,
    is_mask: bool,
    others: Collection[Path] = (),
) -> FolderMatch:
    files, unread = _pictures(folder, argument, problems)
    taken = {path.resolve() for path in others}
    files = [file for file in files if not taken or (folder / file).resolve() not in taken]
    by_name: dict[str, list[str]] = {}
    for file in files:
        for name in _answers_to(file, is_mask):
            by_name.setdefault(name, []).append(file)
    found: dict[str, Path] = {}
    owner: dict[str, str] = {}
    for label, names in wanted.items():
        hits = _best([name for name in names if name], by_name)
        if len(hits) > 1:
            cause = f"the files {listed(sorted(hits)[:4])} match it equally well"
            cure = "keep one of them, or give the folder that holds one of them alone"
            problems.append(Problem(f"{kind} of camera '{label}'", cause, cure))
        elif hits and hits[0] in owner:
            cause = f"file '{hits[0]}' is that of camera '{owner[hits[0]]}' too"
            cure = "give every photo a name of its own"
            problems.append(Problem(f"{kind} of camera '{label}'", cause, cure))
        elif hits:
            owner[hits[0]] = label
            found[label] = folder / hits[0]
    left = tuple(file for file in files if file not in owner)
    without = tuple(label for label in wanted if label not in found)
    return FolderMatch(found, without, left, tuple(unread))


def _best(names: Sequence[str], by_name: dict[str, list[str]]) -> list[str]:
    """The files that match the first of the names that any file matches: those that share most
    folders with it, then its ending, then its case."""
    for name in names:
        path, last = _folded(name), name.replace("\\", "/").rpartition("/")[2]
        files = by_name.get(_stem(path), ())
        scores = {
            file: (*_common_path(path, _folded(file)), file.rpartition("/")[2] == last)
            for file in files
        }
        if scores:
            most = max(scores.values())
            return [file for file, score in scores.items() if score == most]
    return []


def _common_path(wanted: str, file: str) -> tuple[int, bool, bool]:
    """Common folders from the end, the same ending, the same path."""
    *folders, name = wanted.split("/")
    *others, other = file.split("/")
    common = 0
    for first, second in zip(reversed(folders), reversed(others), strict=False):
        if first != second:
            break
        common += 1
    return common, name == other, wanted == file


def _answers_to(file: str, is_mask: bool) -> set[str]:
    """Names without ending that a camera may have for the file."""
    name = _stem(_folded(file))
    names = {name}
    if is_mask:
        names.add(_without_ending(name))  # photo.jpg.png
        names |= {name.removesuffix(ending) for ending in MASK_ENDINGS}
    return names


def _stem(path: str) -> str:
    """The last part of a path without ending."""
    return _without_ending(path).rpartition("/")[2]


def _without_ending(path: str) -> str:
    stem, dot, ending = path.rpartition(".")
    return stem if dot and f".{ending}" in _ENDINGS and not stem.endswith("/") and stem else path


def _folded(text: str) -> str:
    """For comparisons: no case, one form of accents, forward slashes."""
    plain = unicodedata.normalize("NFC", text.strip().replace("\\", "/").casefold())
    return plain.removeprefix("./")


def _pictures(folder: Path, argument: str, problems: list[Problem]) -> tuple[list[str], list[str]]:
    """Paths of pictures relative to the folder, sorted; and of those of kinds that are not read."""
    found, unread = list[str](), list[str]()
    seen = 0
    if not folder.is_dir():
        cure = "give the folder that holds the photos"
        problems.append(Problem(f"Argument {argument} '{folder}'", "it is no folder", cure))
        return found, unread
    for base, folders, names in os.walk(folder):
        folders.sort()
        seen += len(names)
        if seen > _MOST_FILES:
            cause = f"it holds more than {_MOST_FILES} files"
            cure = "give the folder of the photos alone"
            problems.append(Problem(f"Argument {argument} '{folder}'", cause, cure))
            return [], []
        place = Path(base).relative_to(folder)
        names = [name for name in names if not name.startswith(".")]  # as macOS has beside files
        found += [(place / name).as_posix() for name in names if is_picture(name)]
        others = (name for name in names if PurePosixPath(name).suffix.lower() in OTHER_SUFFIXES)
        unread += [(place / name).as_posix() for name in others]
    return sorted(found), sorted(unread)
