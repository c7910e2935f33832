# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture that the file of a mesh names: below its folder, or not at all."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from . import tiles
from .files import Place, inside, is_file, shortened

#: Of an address; one letter is a drive of Windows.
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:|[A-Za-z]:[\\/]|//|\\\\|/")
_PATH = re.compile(r"[A-Za-z]:[\\/]|\\\\|/(?!/)")
#: One string of an MFString: in quotes, in which a backslash keeps the next letter.
_QUOTED = re.compile(r"\"((?:[^\"\\]|\\.)*)\"|'((?:[^'\\]|\\.)*)'", re.DOTALL)
MOST_ADDRESSES = 100


def addresses(text: str, place: Place) -> list[str]:
    """Of an MFString in whatever quotes: tex.png, "tex.png", 'tex.png', or several.
    Raises ReconstructionError."""
    text = text.strip()
    if not text.startswith(('"', "'")):
        return [text] if text else []
    found, at = [], 0
    while at < len(text):
        match = _QUOTED.match(text, at)
        if match is None:
            raise place.error(f"its quotes do not match: {shortened(text)}")
        inner = match[1] if match[1] is not None else match[2]
        found.append(re.sub(r"\\(.)", r"\1", inner, flags=re.DOTALL))
        at = match.end()
        while at < len(text) and (text[at] == "," or text[at].isspace()):
            at += 1
    return [address for address in found if address.strip()][:MOST_ADDRESSES]


def in_any_case(folder: Path, name: str) -> Path | None:
    """The file of that name below `folder`; if it is not there, the one whose name differs only in
    its case, as Windows finds it. None if there is none, several or a folder elsewhere."""
    exact = inside(folder, name)
    if exact is not None and is_file(exact):
        return exact
    place = folder
    for part in PurePosixPath(name).parts:
        try:
            found = [one for one in place.iterdir() if one.name.casefold() == part.casefold()]
        except OSError:
            return None
        if len(found) != 1:
            return None
        place = found[0]
    path = inside(folder, str(place.relative_to(folder)))
    return path if is_file(path) else None


def picture(text: str, place: Place, remarks: list[str]) -> Path | None:
    """The first address that is a file below the folder of the mesh's, or stands for several such
    (`tiles`); None, with a remark, if none of them is there. Raises ReconstructionError if there is
    none and one lies elsewhere."""
    elsewhere = ""
    for address in addresses(text, place):
        if _SCHEME.match(address):
            elsewhere = elsewhere or address
            # A path of the computer where it was written: the picture came along beside the file.
            last = address.replace("\\", "/").rpartition("/")[2]
            local = in_any_case(place.file.parent, last) if _PATH.match(address) else None
            if local is not None:
                return local
            continue
        for name in (address, unquote(address)):
            # Backslashes part folders where these files are written, not where they are read.
            name = name.replace("\\", "/")
            path = in_any_case(place.file.parent, name) or inside(place.file.parent, name)
            if path is None:
                elsewhere = elsewhere or address
            elif is_file(path) or (path is not None and tiles.of(path)):
                return path
    if elsewhere:
        raise place.error(
            f"'{shortened(elsewhere)}' is not a picture below the folder of the file",
            "put the picture beside the file and write its name alone",
        )
    remarks.append(f"the texture '{shortened(text)}' is not there: its faces are white")
    return None
