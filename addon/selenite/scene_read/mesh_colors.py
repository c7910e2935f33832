# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour attribute of an object that its materials show."""

from __future__ import annotations

import numpy as np

from ..problems import BadInput, Problem, choice, listed
from .values import ObjectValues, SceneValues


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
        if material.shader is not None and material.shader.attributes("color"):
            cause = f"material '{material.name}' mixes its colour attributes in a node tree"
            cure = "link the Color Attribute to the Base Color of a Principled BSDF"
            raise BadInput(Problem(title, cause, cure))
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
    cure = "add one under Object Data > Color Attributes"
    raise BadInput(Problem(title, cause, cure))
