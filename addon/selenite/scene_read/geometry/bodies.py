# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects whose material needs a closed body: are they closed, and do they face outwards?

A medium that has no definite inside is refused. A ray carries a medium from where it enters by a
face of its material to where it leaves by one. If it leaves by a hole, by a face of another
material or by one that is turned round, it keeps the medium: Cycles and this renderer agree on that
where the ray then meets a surface (sphere with 1 free path per radius in a closed room, bpy 4.5:
means within 0.1 % for holes, bodies inside out and bodies of two materials; 1.5 % darker than the
closed sphere for a hole away from the camera, 10 % inside out). But where the ray meets the sky
instead, Cycles drops the medium of its last flight and this renderer does not: the means differ by
0.3 % for one face missing of 512, by 10 % for a larger hole, 25 % inside out, 8 % for two
materials. What Cycles shows thus depends on what stands behind the hole; there is no extinction
that a photo would agree with. Mirrored objects render as their originals in both (within 0.01 %),
a hollow (a shell inside that faces into it) and nested or overlapping bodies as well.

Glass and subsurface scattering carry nothing along: open or turned, a ball renders as in Cycles
(within two standard errors, 0.1 to 0.4 %, for six faults each), though hardly as meant, so there a
warning has to do. Subsurface scattering does not see the winding at all.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...messages import remark, thing
from ...problems import Problem
from ..closedness import Closedness, survey
from ..values import BodyValues, MaterialValues, ObjectValues, SceneValues
from .folds import warn_of_folds
from .overlaps import warn_of_overlaps

#: The kind of the Problem of a body whose holes can be filled.
OPEN_BODY = "open-body"
_CLOSE = (
    "in Edit Mode use Mesh > Clean Up > Merge by Distance, then Select > Select All by Trait > "
    "Non Manifold to see what is left, and close it with Mesh > Clean Up > Fill Holes"
)
_CLEAN = (
    "in Edit Mode use Mesh > Clean Up > Merge by Distance, then Select > Select All by Trait > "
    "Non Manifold to see what is left, and delete the faces that are too many"
)
_TURN = "in Edit Mode select all and use Mesh > Normals > Recalculate Outside"
_ONE_MATERIAL = "give every face of the body the same material"
_LIGHT = {
    "glass": "light that enters the glass",
    "subsurface": "light that scatters under the surface",
}


def judge_bodies(read: SceneValues) -> list[BodyValues]:
    """Surveys every object with such a material; puts what it finds into `read.problems` (media)
    and `read.warnings` (glass, subsurface scattering).

    Faces of a material with a medium have to be closed by themselves, the others together with the
    rest of their mesh. Each mesh is surveyed once for all objects that share it. Faces that lie on
    top of each other, or whose normals point backwards, are warned of, whatever their material.
    """
    needs = {item.name: _need(item) for item in read.materials}
    used_slots = [tuple(np.unique(mesh.material_slots).tolist()) for mesh in read.meshes]
    surveys: dict[tuple[int, tuple[int, ...]], Closedness] = {}

    def survey_of(item: ObjectValues, slots: tuple[int, ...]) -> Closedness:
        key = (item.mesh, slots)
        if key not in surveys:
            mesh = read.meshes[item.mesh]
            faces = mesh.triangles[np.isin(mesh.material_slots, slots)]
            surveys[key] = survey(mesh.positions, faces)
        return surveys[key]

    bodies: dict[tuple[str, str, Closedness], BodyValues] = {}
    for item in read.objects:
        used = used_slots[item.mesh]
        for material in dict.fromkeys(item.materials[slot] for slot in used):
            need = needs[material]
            if not need:
                continue
            own = tuple(slot for slot in used if item.materials[slot] == material)
            whole = survey_of(item, used)
            found = survey_of(item, own) if need == "medium" else whole
            key = (item.name, material, found)
            if key not in bodies:
                body = BodyValues(item.name, material, need, found)
                bodies[key] = replace(body, fault=_report(body, whole, read))
    warn_of_folds(read)
    warn_of_overlaps(read)
    return list(bodies.values())


def _need(material: MaterialValues) -> str:
    def acts(name: str) -> bool:
        return name in material.maps or any(material.values.get(name, ()))

    if "extinction" in material.values:
        return "medium"
    if acts("transmission"):
        return "glass"
    return "subsurface" if acts("subsurface_weight") else ""


def _report(body: BodyValues, whole: Closedness, read: SceneValues) -> str:
    """Notes the problem or the warning and returns its text. `whole`: the mesh with all faces."""
    found, title = body.found, thing("Object", body.object)
    if body.need == "medium" and not found.encloses:
        cause = f"the medium of material '{body.material}' has no definite inside: {_faults(found)}"
        if whole.encloses:
            cause += "; faces of other materials close the body, but a medium ends only at its own"
        kind = OPEN_BODY if found.open_edges and not whole.encloses else ""
        problem = Problem(title, cause, _cure(found, whole), kind)
        read.refuse(problem)
        return problem.line()
    if body.need == "medium" and found.nested:
        text = remark(
            title,
            f"{_count(found.nested, 'body', 'bodies')} inside another one with the "
            f"medium of material '{body.material}', facing the same way: the medium "
            "is not doubled there and ends where the inner one is left, as in "
            "Cycles; for a hollow turn the inner one round (Mesh > Normals > Flip)",
        )
    elif (body.need == "glass" and not found.encloses) or (
        body.need == "subsurface" and found.leaks
    ):
        light, faults, cure = _LIGHT[body.need], _faults(found), _cure(found, whole)
        text = remark(
            title,
            f"{light} of material '{body.material}' does not come out as from a "
            f"closed body: {faults}; Cycles renders the same, but if a body is "
            f"meant: {cure}",
        )
        if found.doubled_faces:
            text = remark(
                title,
                f"{light} of material '{body.material}' does not come out as from a "
                f"closed body: {faults}; Cycles shows faces on top of others otherwise: "
                f"{cure}",
            )
    else:
        return ""
    read.warn(text)
    return text


def _faults(found: Closedness) -> str:
    parts = [
        _count(found.open_edges, "open edge", "open edges"),
        _count(
            found.loose_crowded_edges,
            "edge with more than two faces",
            "edges with more than two faces",
        ),
        _count(found.doubled_faces, "face on top of another", "faces on top of others"),
        _count(
            found.disagreeing_faces,
            "face wound against its neighbours",
            "faces wound against their neighbours",
        ),
        _count(found.inside_out, "body turned inside out", "bodies turned inside out"),
    ]
    return ", ".join(part for part in parts if part)


def _cure(found: Closedness, whole: Closedness) -> str:
    if whole.encloses:
        return _ONE_MATERIAL
    steps = []
    if found.open_edges:
        steps.append(_CLOSE)
    elif found.loose_crowded_edges or found.doubled_faces:
        steps.append(_CLEAN)
    if found.disagreeing_faces or found.inside_out:
        steps.append(_TURN)
    return "; then ".join(steps)


def _count(number: int, one: str, many: str) -> str:
    """ "3 open edges", or nothing for 0."""
    return f"{number} {one if number == 1 else many}" if number else ""
