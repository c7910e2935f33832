# SPDX-License-Identifier: GPL-3.0-or-later
"""Labels of cameras: unique in a reconstruction, and a few of many in remarks on those left out."""

from __future__ import annotations

from ...problems import listed
from .files import Place, shortened

#: Cameras whose labels a remark spells out.
MOST_NAMED = 5
#: Letters of a label: those of a path.
LONGEST = 4096


class Labels:
    """Sees that no label comes twice."""

    def __init__(self) -> None:
        self._seen: set[str] = set()

    def add(self, label: str, place: Place) -> str:
        """The label. Raises ReconstructionError if it is empty or was there before."""
        if not label.strip():
            raise place.error("it has no label", "give it one where it was made")
        usable_text(label, place)
        if label in self._seen:
            raise place.error("the label comes twice", "rename one of the photos and export again")
        self._seen.add(label)
        return label


class LeftOut:
    """Cameras that are not read, or others, `kind`, of which something is to be said: a line for
    each cause, however many they are."""

    def __init__(self, kind: str = "camera") -> None:
        self._kind = kind
        self._labels: dict[str, list[str]] = {}

    def add(self, label: str, cause: str) -> None:
        """One of them."""
        self._labels.setdefault(cause, []).append(label)

    def remarks(self) -> list[str]:
        """A line for each cause."""
        return [f"{_named(self._kind, labels)}: {cause}" for cause, labels in self._labels.items()]

    def causes(self) -> str:
        """All of them, "" where nothing is left out."""
        return "; ".join(self._labels)


def usable_text(text: str, place: Place) -> str:
    """The same, if a name can be made of it. Raises ReconstructionError."""
    if len(text) > LONGEST or any(
        ord(letter) < 32 or "\ud800" <= letter <= "\udfff" for letter in text
    ):
        raise place.error("a name in it has control characters or is too long", "rename the photo")
    return text


def _named(kind: str, labels: list[str]) -> str:
    """cameras 'A', 'B' and 3 more."""
    shown = listed(shortened(label) for label in labels[:MOST_NAMED])
    more = len(labels) - MOST_NAMED
    plural = "" if len(labels) == 1 else "s"
    return f"{kind}{plural} {shown}" + (f" and {more} more" if more > 0 else "")
