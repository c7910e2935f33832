# SPDX-License-Identifier: GPL-3.0-or-later
"""XML as readers want it: no DOCTYPE, no entities, and bounded in every way."""

from __future__ import annotations

import re
import secrets
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from .files import Place, read_bytes, shortened

#: Tags, opened or closed, and attributes: ten thousand cameras have some three hundred thousand.
MOST_TAGS = 1_000_000
#: Bytes of a namespace's name, which the parser puts before each name of an element.
LONGEST_NAMESPACE = 200
_NAMESPACE = re.compile(
    rb"xmlns[^=<>]{0,100}=\s*(?:\"[^\"]{%d}|'[^']{%d})" % (LONGEST_NAMESPACE, LONGEST_NAMESPACE)
)
DEEPEST = 200
#: A value of 64 KiB or more. Expat reads such a one again for each MiB of it, so it is kept aside.
_LONG = re.compile(rb'="([^"<&]{65536,}+)"')


class _TooDeep(Exception):
    pass


class _Builder(TreeBuilder):
    """Keeps names without their namespaces, and no comments; puts long values where `mark` and
    their number stand."""

    def __init__(self, mark: str, values: list[bytes]) -> None:
        super().__init__()
        self._depth, self._mark, self._values = 0, mark, values

    def start(self, tag: str, attributes: dict[str, str]) -> Element:
        self._depth += 1
        if self._depth > DEEPEST:
            raise _TooDeep
        for name, value in attributes.items():
            if value.startswith(self._mark):
                attributes[name] = self._taken(int(value[len(self._mark) :]))
        return super().start(tag.rpartition("}")[2], attributes)

    def _taken(self, index: int) -> str:
        value, self._values[index] = self._values[index], b""
        return value.decode("utf-8")

    def end(self, tag: str) -> Element:
        self._depth -= 1
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
    if _NAMESPACE.search(data):
        raise place.error(f"the name of a namespace is longer than {LONGEST_NAMESPACE} bytes")
    # A file cannot know the mark, and so not ask for another value than its own.
    mark = secrets.token_hex(16)
    values: list[bytes] = []

    def taken(match: re.Match[bytes]) -> bytes:
        values.append(match[1])
        return b'="%b%d"' % (mark.encode(), len(values) - 1)

    data = _LONG.sub(taken, data)
    # The encoding is settled here: that of a declaration could hide tags from the count above.
    parser = DefusedXMLParser(target=_Builder(mark, values), encoding="utf-8", forbid_dtd=True)
    try:
        parser.feed(data)
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
