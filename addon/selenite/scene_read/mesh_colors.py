# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour attribute of an object that its materials show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..messages import control
from ..problems import BadInput, Problem, choice, listed
from .values import MapValues, ObjectValues, SceneValues

#: What a new attribute is called where no material names it.
NEW_COLORS = "Selenite"
_ADD_ONE = control(
    "new-colors", "add one under Object Data > Color Attributes, or give --grid OBJECT:...=new"
)


def object_of(scene: SceneValues, name: str, title: str) -> ObjectValues:
    """The object of a name. Raises BadInput."""
    found = next((item for item in scene.objects if item.name == name), None)
    if found is None:
        cause = f"no object of the scene is called '{name}'"
        names = list(dict.fromkeys(item.name for item in scene.objects))
        raise BadInput(Problem(title, cause, choice(name, names)))
    return found


def shown_colors(
    scene: SceneValues, owner: ObjectValues, title: str
) -> tuple[str, np.ndarray, np.ndarray]:
    """Name, values and elements of the one attribute that the object's materials show. Raises
    BadInput."""
    mesh = scene.meshes[owner.mesh]
    used = [item for item in scene.materials if item.name in owner.materials]
    asked: dict[str, str] = {}  # attribute -> what becomes of it on the way
    for material in used:
        for found in material.maps.values():
            if found.texture is None:
                default = mesh.colors[0][0] if mesh.colors else ""
                asked[found.attribute or default] = found.grey or asked.get(
                    found.attribute or default, ""
                )
        if material.shader is not None:
            default = mesh.colors[0][0] if mesh.colors else ""
            for attribute in material.shader.attributes("color"):
                asked.setdefault(attribute or default, "")
    if not asked:
        cause = "none of its materials shows a colour attribute"
        cure = "link a Color Attribute node to the Base Color"
        raise BadInput(Problem(title, cause, cure))
    if len(asked) > 1:
        cause = f"its materials show the colour attributes {listed(sorted(asked))}"
        raise BadInput(Problem(title, cause, "let them show one"))
    name, grey = next(iter(asked.items()))
    if grey:
        cause = f"a socket on the way from the colour attribute '{name}' makes it grey"
        raise BadInput(Problem(title, cause, "link it through sockets of colours only"))
    stored = next((item for item in mesh.stored_colors if item[0] == name), None)
    if stored is not None:
        return stored
    if name in {item for item, _ in mesh.colors}:
        cause = f"modifiers make other vertices than those of the colour attribute '{name}'"
        raise BadInput(Problem(title, cause, "apply the modifiers, or switch them off"))
    cause = f"its mesh has no colour attribute '{name}'" if name else "it has no colour attribute"
    raise BadInput(Problem(title, cause, _ADD_ONE))


@dataclass(frozen=True)
class NewColors:
    """A colour attribute that is to be made, with a colour at each vertex. values: (n, 3) linear;
    elements: as of `shown_colors`. materials: whose base colour is to show it."""

    attribute: str
    values: np.ndarray
    elements: np.ndarray
    materials: tuple[str, ...]


def new_colors(scene: SceneValues, owner: ObjectValues, title: str) -> NewColors:
    """The attribute that an object's materials look up and its mesh lacks; where none looks one up,
    one in place of their base colours. Raises BadInput."""
    mesh = scene.meshes[owner.mesh]
    used = [item for item in scene.materials if item.name in owner.materials]
    asked = {
        found.attribute for item in used for found in item.maps.values() if found.texture is None
    }
    for item in used:
        asked |= item.shader.attributes("color") if item.shader is not None else set()
    known = {name for name, _ in mesh.colors}
    if len(asked) > 1 or asked & known or ("" in asked and known):
        cause = "its materials look up colour attributes that it has"
        raise BadInput(Problem(title, cause, "fit these, or let the materials look up another one"))
    if not mesh.own_vertices:
        cause = "modifiers move its vertices or make others"
        raise BadInput(Problem(title, cause, "apply the modifiers, or switch them off in renders"))
    fixed = [
        item.name
        for item in used
        if item.shader is not None or "base_color" in item.maps or "base_color" not in item.values
    ]
    if not asked and (fixed or not used):
        cause = f"the base colour of material '{fixed[0]}' is no constant" if fixed else ""
        cause = cause or "it has no material"
        raise BadInput(Problem(title, cause, "give it materials with plain base colours"))
    colour = np.array([0.8] * 3, np.float32)
    if not asked:
        colour = np.mean([item.values["base_color"] for item in used], axis=0, dtype=np.float32)
    return NewColors(
        next(iter(asked), "") or NEW_COLORS,
        np.broadcast_to(colour, mesh.positions.shape).astype(np.float32),
        np.ascontiguousarray(mesh.triangles, np.int32).ravel(),
        () if asked else tuple(item.name for item in used),
    )


def color_map(attribute: str) -> MapValues:
    """A parameter that comes from a colour attribute."""
    return MapValues(None, attribute)
