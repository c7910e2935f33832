# SPDX-License-Identifier: GPL-3.0-or-later
"""Which photo and which mask a camera has, and what is left over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..problems import Problem, listed
from .photo_folder import files_by_path, masks_among, match_masks, match_photos
from .reconstruction import Reconstruction

_MOST_LISTED = 12


@dataclass(frozen=True)
class Pairs:
    """photos, masks: by the camera's label. without: labels of cameras without a photo. left:
    photos of no camera. remarks: on all that has no counterpart, a line each."""

    photos: dict[str, Path]
    masks: dict[str, Path]
    without: tuple[str, ...]
    left: tuple[str, ...]
    remarks: tuple[str, ...]


def pair(
    found: Reconstruction,
    source: Path,
    photos: Path | None,
    masks: Path | None,
    problems: list[Problem],
) -> Pairs:
    """source: the file of the cameras, or its folder. photos, masks: folders; None: where the file
    names them."""
    left: tuple[str, ...] = ()
    folder = source if source.is_dir() else source.parent
    remarks: list[str] = []
    if photos is not None:
        match = match_photos(found.cameras, photos, problems)
        files, left = match.files, match.left
        if match.unread and len(files) < len(found.cameras):
            remarks.append(f"not read, so convert them to PNG or TIFF: {_some(match.unread)}")
    else:
        files = files_by_path({item.label: item.photo for item in found.cameras}, folder)
    without = tuple(item.label for item in found.cameras if item.label not in files)
    if without:
        cure = "; give the folder of the photos" if photos is None else ""
        remarks.append(f"cameras without a photo: {_some(without)}{cure}")
    if masks is None:
        named = {item.label: item.mask for item in found.cameras if item.label in files}
        of_photos = files_by_path(named, folder)
        gone = [label for label, name in named.items() if name and label not in of_photos]
        if gone:
            remarks.append(f"masks that the file names, but are not there: {_some(gone)}")
    else:
        match = match_masks(found.cameras, masks, problems, files.values())
        used = {file.resolve() for file in match.files.values()}
        left = tuple(name for name in left if photos and (photos / name).resolve() not in used)
        of_photos = {label: file for label, file in match.files.items() if label in files}
        missing = [label for label in files if label not in of_photos]
        unused = [*match.left, *(file.name for k, file in match.files.items() if k not in files)]
        if missing:
            remarks.append(f"photos without a mask: {_some(missing)}")
        if unused:
            remarks.append(f"masks without a photo: {_some(unused)}")
    if left:
        remarks += _remarks_on_left(left, found, masks is None)
    return Pairs(files, of_photos, without, left, tuple(remarks))


def _remarks_on_left(left: Sequence[str], found: Reconstruction, no_masks: bool) -> list[str]:
    """On photos of no camera, among which masks may be."""
    masks = masks_among(found.cameras, left) if no_masks else []
    rest = [name for name in left if name not in masks]
    remarks = [f"photos without a camera: {_some(rest)}"] if rest else []
    if masks:
        remarks.append(
            f"masks among the photos: {_some(masks)}; give their folder as that of masks"
        )
    return remarks


def _some(names: Sequence[str]) -> str:
    more = len(names) - _MOST_LISTED
    return listed(names[:_MOST_LISTED]) + (f" and {more} more" if more > 0 else "")
