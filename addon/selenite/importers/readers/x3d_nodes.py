# SPDX-License-Identifier: GPL-3.0-or-later
"""The tree of an X3D scene: DEF and USE, transforms, and what stands where.

Source: ISO/IEC 19775-1 (X3D architecture), 4.4.4 (DEF/USE), 10.4.4 (Transform).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from . import numbers
from .files import Place, shortened

#: Nodes that are met on the way through a scene, those of a USE each time it is used.
MOST_NODES = 500_000
#: Of groups in each other; a file's elements cannot be nested deeper (`xml_tree.DEEPEST`), USE can.
DEEPEST = 100
#: Nodes whose children are no part of the scene; those of any other, known here or not, are.
CLOSED = frozenset(("Shape", "ProtoDeclare", "ExternProtoDeclare", "Script"))
#: Nodes that would show something, of which this reader takes nothing.
UNREAD = frozenset((
    "Inline", "ProtoInstance", "GeoTransform", "GeoLocation", "GeoViewpoint", "GeoLOD",
    "OrthoViewpoint", "ViewpointGroup", "HAnimHumanoid", "ParticleSystem", "LayerSet",
    "Layout",
))  # fmt: skip


class Nodes:
    """A scene's nodes by their names."""

    def __init__(self, scene: Element, file: Path) -> None:
        self.scene, self.file = scene, file
        self.unread: set[str] = set()
        self._named: dict[str, Element] = {}
        self._met = self._read = 0
        for element in scene.iter():
            name = element.get("DEF")
            if name is None:
                continue
            if name in self._named:
                raise self.place(element).error("the name of its DEF comes twice")
            self._named[name] = element

    def place(self, element: Element, field: str = "") -> Place:
        """For messages about it."""
        name = element.get("DEF") or element.get("description")
        where = element.tag + (f" '{shortened(name)}'" if name else "")
        return Place(self.file, f"{where}, {field}" if field else where)

    def resolved(self, element: Element) -> Element:
        """The node that a USE means, or the element itself. Raises ReconstructionError."""
        name = element.get("USE")
        if name is None:
            return element
        found = self._named.get(name)
        if found is None or found.tag != element.tag or found.get("USE") is not None:
            raise self.place(element).error(f"no {element.tag} has the DEF '{shortened(name)}'")
        return found

    def child(self, element: Element, *tags: str) -> Element | None:
        """The first child of one of these kinds, behind its USE."""
        for one in element:
            if one.tag in tags:
                return self.resolved(one)
        return None

    def placed(self, *tags: str) -> Iterator[tuple[Element, np.ndarray]]:
        """Nodes of these kinds with the 4 x 4 matrix from where they stand to the world, in the
        order of the file. Raises ReconstructionError."""
        yield from self._below(self.scene, np.eye(4), frozenset(tags), ())

    def _below(
        self, parent: Element, matrix: np.ndarray, tags: frozenset[str], above: tuple[int, ...]
    ) -> Iterator[tuple[Element, np.ndarray]]:
        if len(above) > DEEPEST:
            raise self.place(parent).error(f"its groups are nested deeper than {DEEPEST}")
        for one in self._shown(parent):
            self._met += 1
            if self._met > MOST_NODES:
                raise self.place(parent).error(f"the scene has more than {MOST_NODES} nodes")
            element = self.resolved(one)
            if id(element) in above:
                raise self.place(element).error("it is used inside itself")
            if element.tag in tags:
                yield element, matrix
            elif element.tag in UNREAD:
                self.unread.add(element.tag)
            elif element.tag not in CLOSED:
                inner = matrix
                if element.tag == "Transform":
                    inner = matrix @ self.transform(element)
                    numbers.finite(inner, self.place(element))
                yield from self._below(element, inner, tags, (*above, id(element)))

    def _shown(self, parent: Element) -> list[Element]:
        """Children that are seen: of a Switch the chosen one, of a LOD the finest."""
        if parent.tag not in ("Switch", "LOD"):
            return list(parent)
        choice = 0
        children = [one for one in parent if not one.tag.startswith("Metadata")]
        if parent.tag == "Switch":
            text = parent.get("whichChoice", "-1")
            choice = numbers.whole(text, self.place(parent, "whichChoice"))
        return [children[choice]] if 0 <= choice < len(children) else []

    def transform(self, element: Element) -> np.ndarray:
        """4 x 4: T C R SR S -SR -C. Raises ReconstructionError."""
        centre = self.vector(element, "center", (0, 0, 0))
        scale = self.vector(element, "scale", (1, 1, 1))
        if not (np.abs(scale) >= 1e-12).all():
            raise self.place(element, "scale").error("a side of it is 0")
        stretch = self.rotation(element, "scaleOrientation")
        found = np.eye(4)
        turn = self.rotation(element, "rotation")
        found[:3, :3] = turn @ stretch @ np.diag(scale) @ stretch.T
        moved = self.vector(element, "translation", (0, 0, 0)) + centre
        found[:3, 3] = moved - found[:3, :3] @ centre
        return found

    def numbers(self, element: Element, field: str, count: int | None = None) -> np.ndarray | None:
        """Of a field, between which commas are white space; None where it is absent."""
        text = element.get(field)
        if text is None:
            return None
        if "," in text:
            text = text.replace(",", " ")
        found = numbers.numbers(text, self.place(element, field), count)
        self._read += len(found)
        if self._read > numbers.MOST_NUMBERS:
            cause = f"the scene has more than {numbers.MOST_NUMBERS} numbers"
            raise self.place(element, field).error(cause, "reduce the mesh and export it again")
        return found

    def vector(self, element: Element, field: str, usual: tuple[float, ...]) -> np.ndarray:
        """(n,) of a field, `usual` where it is absent."""
        found = self.numbers(element, field, len(usual))
        return np.array(usual, dtype=np.float64) if found is None else found

    def flag(self, element: Element, field: str, usual: bool) -> bool:
        """Of a field. Raises ReconstructionError."""
        text = element.get(field, "true" if usual else "false").strip().lower()
        if text not in ("true", "false"):
            raise self.place(element, field).error(f"'{shortened(text)}' is not true or false")
        return text == "true"

    def rotation(self, element: Element, field: str) -> np.ndarray:
        """3 x 3 of an axis and an angle in radians."""
        x, y, z, angle = self.vector(element, field, (0, 0, 1, 0))
        length = math.sqrt(x * x + y * y + z * z)
        if angle == 0.0:
            return np.eye(3)
        if not length > 1e-8:
            raise self.place(element, field).error("its axis is 0 0 0")
        half = math.sin(angle / 2) / length
        wxyz = np.array([math.cos(angle / 2), x * half, y * half, z * half])
        return numbers.quaternion_rotation(wxyz, self.place(element, field))
