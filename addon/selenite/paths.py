# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths as a user gives them: what is wrong with one is a sentence, never an exception.

A name need not be UTF-8: Python holds its other bytes as lone surrogates, and gives them back.
"""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
import unicodedata
from collections.abc import Iterable
from pathlib import Path

MISSING = "it does not exist"
#: Bytes of a file's name that file systems permit, and of a stem: endings follow it.
_LONGEST_NAME, _LONGEST_STEM = 255, 150
#: Names that are devices on Windows, whatever follows their first dot.
_DEVICES = frozenset(
    ("con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10)))
)


def is_folder(path: Path) -> bool:
    """As Path.is_dir, which raises for some names."""
    return os.path.isdir(path)


def is_there(path: Path) -> bool:
    """As Path.exists, which raises for some names."""
    return os.path.exists(path)


def absolute(text: str | Path) -> Path:
    """`text` with the home folder filled in and links followed, as far as that goes."""
    expanded = os.path.expanduser(str(text))
    try:
        return Path(os.path.realpath(expanded))
    except ValueError:  # a zero byte, which no file's name has: `why_not_file` says so
        return Path(expanded)


def user_folder() -> Path:
    """Where results go that have no other place: "Selenite" in the user's documents."""
    import platformdirs

    return Path(platformdirs.user_documents_dir()) / "Selenite"


def why_not_file(path: str | Path) -> str:
    """Why `path` is no file that can be read; empty if it is one. A pipe or a device, which may
    never end, is none."""
    try:
        mode = os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return MISSING
    except (OSError, ValueError) as error:
        return _text(error)
    if stat.S_ISDIR(mode):
        return "it is a folder"
    if not stat.S_ISREG(mode):
        return "it is a pipe or a device, not a file"
    return "" if os.access(path, os.R_OK) else "permission is denied"


def why_not_folder(path: Path, needed: int = 0) -> str:
    """Why nothing can be written into the folder `path`, which may have to be made; empty if all is
    well. `needed`: bytes that will be written."""
    try:
        while not os.path.lexists(path):
            if path == path.parent:
                return MISSING
            if len(os.fsencode(path.name)) > _LONGEST_NAME:
                return "its name is too long"
            path = path.parent
        if not is_folder(path):
            return f"'{path}' is not a folder"
        with tempfile.TemporaryFile(dir=path):  # rights, and whether it can be written at all
            pass
        free = shutil.disk_usage(path).free
    except (OSError, ValueError) as error:
        return f"it cannot be written ({_text(error)})"
    if free < needed:
        return f"the disk has {_size(free)} left, and the files take about {_size(needed)}"
    return ""


def why_not_output(path: Path) -> str:
    """Why the file `path` cannot be written, in a folder that exists; empty if it can."""
    if is_folder(path):
        return "it is a folder"
    if not is_folder(path.parent):
        return "its folder does not exist"
    if len(os.fsencode(path.name)) > _LONGEST_NAME:
        return "its name is too long"
    if os.path.lexists(path):
        if why := why_not_file(path):
            return why
        if not os.access(path, os.W_OK):
            return "permission is denied"
    return why_not_folder(path.parent)


def file_stems(names: Iterable[str]) -> dict[str, str]:
    """Each name of the scene's as a part of a file's name, no two alike, not even where case or the
    form of accents do not count. A name that needs no change keeps it; where others become equal
    they get numbers, in their order."""
    names = list(dict.fromkeys(names))
    stems = {name: _cleaned(name) for name in names}
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in sorted(names, key=lambda item: stems[item] != item):  # the unchanged ones first
        stem, number = stems[name], 1
        while _folded(stem) in taken:
            number += 1
            stem = f"{stems[name]}-{number}"
        taken.add(_folded(stem))
        found[name] = stem
    return {name: found[name] for name in names}


def _cleaned(text: str) -> str:
    name = "".join(c if c.isalnum() or c in "-_.#" else "_" for c in text)
    name = name.encode()[:_LONGEST_STEM].decode(errors="ignore")
    name = name.lstrip(".") or "_"  # a leading dot would hide the file
    return f"_{name}" if name.partition(".")[0].casefold() in _DEVICES else name


def _folded(text: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", text).casefold())


def _text(error: OSError | ValueError) -> str:
    return (getattr(error, "strerror", None) or str(error)).lower()


def _size(count: float) -> str:
    for unit in ("bytes", "kB", "MB"):
        if count < 1000:
            return f"{count:.0f} {unit}"
        count /= 1000
    return f"{count:.1f} GB"
