# SPDX-License-Identifier: GPL-3.0-or-later
"""XML as readers want it: no DOCTYPE, no entities, and bounded in every way."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from .files import Place, read_bytes, shortened

#: Tags, opened or closed, and attributes: ten thousand cameras have some three hundred thousand.
MOST_TAGS = 2_000_000
DEEPEST = 200
_PIECE = 1 << 20


class _TooDeep(Exception):
    pass


class _Builder(TreeBuilder):
    """Keeps names without their namespaces, and no comments."""

    depth = 0

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self.depth += 1
        if self.depth > DEEPEST:
            raise _TooDeep
        return super().start(tag.rpartition("}")[2], attributes)

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag.rpartition("}")[2])


def read_tree(file: Path) -> Element:
    """The root of a file, unpacked if it is gzip's. Raises ReconstructionError."""
    return tree_of(read_bytes(file), file)


def tree_of(data: bytes, file: Path) -> Element:
    """The root of a file with that content. Raises ReconstructionError."""
    place = Place(file, "XML")
    if max(data.count(b"<"), data.count(b"=")) > MOST_TAGS:
        cause = f"it has more than {MOST_TAGS} tags or attributes"
        raise place.error(cause, "export cameras and mesh alone")
    # The encoding is settled here: that of a declaration could hide tags from the count above.
    parser = DefusedXMLParser(target=_Builder(), encoding="utf-8", forbid_dtd=True)
    try:
        for start in range(0, len(data), _PIECE):
            parser.feed(data[start : start + _PIECE])
        root: Element = parser.close()
    except DefusedXmlException as error:
        raise place.error(
            "it has a DOCTYPE or entities, which are not read",
            "delete the part between '<!DOCTYPE' and its '>'",
        ) from error
    except _TooDeep as error:
        raise place.error(f"its elements are nested deeper than {DEEPEST}") from error
    except (ParseError, ValueError) as error:
        raise place.error(f"it is no XML in UTF-8 ({shortened(str(error))})") from error
    return root


def child(element: Element, name: str, place: Place) -> Element:
    """The one child of that name. Raises ReconstructionError where there is none."""
    found = element.find(name)
    if found is None:
        raise place.error(f"it has no <{name}>")
    return found


def attribute(element: Element, name: str, place: Place) -> str:
    """Raises ReconstructionError where it is missing."""
    found = element.get(name)
    if found is None:
        raise place.error(f'it has no {name}="..."')
    return found
