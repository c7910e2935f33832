# SPDX-License-Identifier: GPL-3.0-or-later
"""The Surface of a material as a list of closures, each with its share of the mixture."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import bpy

from .... import native
from ....messages import control, joined, phrase
from ....parameters import Parameter, row_of
from ... import hosts
from ...shaders import Closure, Register
from .. import nodes
from ..nodes import Groups, Source
from . import arithmetic, colors, images, inputs, normals, textures, vectors  # noqa: F401 - makers
from .tangents import tangent_of
from .tree import Tree

Node = bpy.types.Node

MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"
_KINDS = {
    "ShaderNodeBsdfPrincipled": "principled",
    "ShaderNodeBsdfDiffuse": "diffuse",
    "ShaderNodeBsdfAnisotropic": "glossy",
    "ShaderNodeBsdfGlossy": "glossy",
    "ShaderNodeBsdfGlass": "glass",
    "ShaderNodeBsdfRefraction": "refraction",
    "ShaderNodeBsdfTranslucent": "translucent",
    "ShaderNodeBsdfTransparent": "transparent",
    "ShaderNodeEmission": "emission",
    "ShaderNodeSubsurfaceScattering": "subsurface",
    "ShaderNodeBsdfSheen": "sheen",
    "ShaderNodeBsdfMetallic": "metallic",
}
#: More closures at one point are refused; see native/model/closures/closure.h.
MOST_CLOSURES = 16
#: What sockets of one type make of another's values.
_CONVERSIONS = {"luminance", "mean"}
#: The parameters of a film; nothing varies where it is not there.
_FILM = ("thin_film_thickness", "thin_film_ior")
#: Distributions of micronormals that are rendered; SHARP is Blender 3's.
_DISTRIBUTIONS = {"GGX", "MULTI_GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY", "SHARP"}
_CURE = "use a Principled BSDF, or another shader that is read"
#: What is fitted of a closure unless something else is asked for.
_USUAL = {
    "principled": ("base_color", "roughness", "transmission", "ior"),
    "diffuse": ("color",),
    "glossy": ("color", "roughness"),
    "glass": ("color", "roughness", "ior"),
    "refraction": ("color", "roughness", "ior"),
    "translucent": ("color",),
    "transparent": ("color",),
    "emission": ("strength",),
    "subsurface": ("color",),
    "sheen": ("color", "roughness"),
    "metallic": ("base_color", "roughness"),
    "conductor": ("roughness",),
}
#: Kind of closure -> what makes two widths of its roughness.
_STRETCHES = {
    "principled": "anisotropic",
    "glossy": "anisotropy",
    "metallic": "anisotropy",
    "conductor": "anisotropy",
}
#: The cure of what the nearest shader can stand for.
APPROXIMATE = phrase(
    "or let the nearest shader stand for it: {approximate}",
    approximate=control("approximate", "--approximate"),
)


@lru_cache(maxsize=1)
def closure_rows() -> dict[str, list[Parameter]]:
    """The parameters of each kind of closure. Raises NativeUnavailable."""
    return {kind: [row_of(row) for row in rows] for kind, rows in native.core().closures().items()}


@dataclass
class _Found:
    """A closure's node, and by what shares of the whole it is reached. `shut`: the constant
    factors of 0 or 1 that leave it none."""

    node: Node
    groups: Groups
    weight: Register | None
    shut: frozenset[str] = frozenset()
    index: int = -1  # among the closures of the shader


@dataclass
class _Walk:
    """Closures that were met, and sides of a mixture to enter after all that has a share."""

    found: dict[tuple[int, ...], _Found] = field(default_factory=dict)
    later: list[tuple[Source, Register, str]] = field(default_factory=list)


def compile_surface(tree: Tree, source: Source) -> None:
    """Fills `tree.shader` with what `source`, the Surface of an output, is linked to."""
    tree.shader.flavour = hosts.flavour()
    walk = _Walk()
    _enter(tree, source, None, walk)
    found = walk.found
    _add_closures(tree, found)
    for side in walk.later:
        _read_shut(tree, side, found)


def _add_closures(tree: Tree, found: dict[tuple[int, ...], _Found]) -> None:
    closures = tree.shader.closures
    number = len(closures) + len(found)
    if number > MOST_CLOSURES:
        first = next(iter(found.values()))
        cause = f"{{}} is one of {number} shaders of one surface, of which {MOST_CLOSURES} are read"
        tree.refuse(first.node, cause, "mix fewer shaders")
    for item in found.values():
        closure = _closure(tree, item)
        if closure is not None:
            item.index = len(closures)
            closures.append(closure)


def _read_shut(
    tree: Tree, side: tuple[Source, Register, str], known: dict[tuple[int, ...], _Found]
) -> None:
    """The side of a mixture whose factor gives it no share: a fit of the factor would. What cannot
    be rendered there is no problem, and only keeps the factor from being fitted."""
    source, weight, factor = side
    with tree.tried() as problems:
        walk = _Walk()
        _enter(tree, source, weight, walk, frozenset({factor}))
        shared = {key: walk.found.pop(key) for key in known if key in walk.found}
        _add_closures(tree, walk.found)
        one, closures = tree.shader.literal(1), tree.shader.closures
        for key, item in shared.items():
            at = known[key].index
            if at >= 0:  # it has a share by another way too
                sum_of = tree.math("ADD", closures[at].weight or one, item.weight or one)
                closures[at] = replace(closures[at], weight=sum_of)
    if problems:
        tree.one_sided.add(factor)


def _enter(
    tree: Tree,
    source: Source,
    weight: Register | None,
    walk: _Walk,
    shut: frozenset[str] = frozenset(),
) -> None:
    node, groups = source.node, source.groups
    if node is None or source.socket.type != "SHADER":
        return  # nothing: black
    if node.bl_idname in {MIX, ADD}:
        _enter_mixture(tree, node, groups, weight, walk, shut)
        return
    key = (node.as_pointer(), *(group.as_pointer() for group in groups))
    known = walk.found.get(key)
    if known is None:
        walk.found[key] = _Found(node, groups, weight, shut)
    else:
        one = tree.shader.literal(1)
        known.weight = tree.math("ADD", known.weight or one, weight or one)
        known.shut &= shut


def _enter_mixture(
    tree: Tree,
    node: Node,
    groups: Groups,
    weight: Register | None,
    walk: _Walk,
    shut: frozenset[str],
) -> None:
    shaders = [item for item in node.inputs if item.type == "SHADER"]
    sources = [nodes.source_of(item, groups) for item in shaders]
    if node.bl_idname == ADD:
        for source in sources:
            _enter(tree, source, weight, walk, shut)
        return
    value = nodes.constant(nodes.source_of(node.inputs[0], groups))
    register = tree.value(node.inputs[0], groups)
    # Cut off even where Blender permits no other number: the factor may be linked.
    zero, one = tree.shader.literal(0), tree.shader.literal(1)
    second = tree.math("ADD", register, zero, clamp=True)
    first = tree.math("SUBTRACT", one, second)
    for side, (share, source) in enumerate(zip((first, second), sources, strict=True)):
        inner = share if weight is None else tree.math("MULTIPLY", weight, share)
        if value is None or 0 < value[0] < 1 or side == (value[0] >= 1):
            _enter(tree, source, inner, walk, shut)
        elif register.kind == "constant":
            name = tree.shader.constants[register.index].parameter.name
            if shut:
                _enter(tree, source, inner, walk, shut | {name})
            else:
                walk.later.append((source, inner, name))


def _closure(tree: Tree, item: _Found) -> Closure | None:
    node, groups = item.node, item.groups
    kind = _KINDS.get(node.bl_idname)
    if kind is None and tree.room.approximations is not None:
        return _nearest(tree, item)
    if kind is None:
        tree.refuse(node, "{} is a shader that is not modelled", joined("; ", (_CURE, APPROXIMATE)))
        return None
    known = len(tree.problems)
    _judge(tree, node, groups)
    if tree.room.approximations is not None:
        for problem in tree.problems[known:]:
            _approximate(tree, node, f"{problem.cause}: it is rendered without that")
        del tree.problems[known:]
    if kind == "metallic" and node.fresnel_type == "PHYSICAL_CONDUCTOR":
        kind = "conductor"
    rows = closure_rows()[kind]
    version = hosts.node_version()
    registers = {
        row.name: tree.parameter(node, row, groups)
        if version in row.versions
        else tree.shader.literal(*(0.0,) * row.width)
        for row in rows
    }
    if kind == "diffuse" and _is_computed(tree, registers["roughness"]):
        # Its energy term divides 0 by 0 in 32 bits: 1e-7 is black, 0 and 2e-7 are not.
        tree.warnings.append(
            f"where the Roughness of {nodes.describe(node)} is above 0 and below 2e-7, Cycles "
            "shows black, which is not modelled; add 1e-6 to it"
        )
    distribution = getattr(node, "distribution", "GGX")
    if distribution == "SHARP":  # Blender 3
        registers["roughness"] = tree.shader.literal(0)
    if distribution not in _DISTRIBUTIONS or distribution == "SHARP":  # sheen has others
        distribution = "GGX"
    if _FILM[0] in registers and tree.number_of(node, "Thin Film Thickness", groups) == 0:
        registers |= dict.fromkeys(_FILM, tree.shader.literal(0))
    tangent = None
    stretch = _STRETCHES.get(kind, "")
    if stretch and version in next(row for row in rows if row.name == stretch).versions:
        if tree.number_of(node, stretch.capitalize(), groups) == 0:
            registers[stretch] = tree.shader.literal(0)  # two widths that stay one
        else:
            tangent = tangent_of(tree, node, groups)
    if not item.shut:
        _note_usual(tree, kind, registers, rows)
    return Closure(
        kind,
        registers,
        item.weight,
        tree.normal(node, groups),
        tangent,
        distribution,
        tuple(sorted(item.shut)),
        subsurface=_subsurface(node),
    )


def _is_computed(tree: Tree, register: Register) -> bool:
    """Whether it varies, and not as an image does: that is 0 over a whole texel or not at all."""
    while register.kind == "code":
        code = tree.shader.code[register.index]
        if code.op not in _CONVERSIONS or code.inputs[0] is None:
            return code.op != "image"
        register = code.inputs[0]
    return False


def _note_usual(
    tree: Tree, kind: str, registers: dict[str, Register], rows: list[Parameter]
) -> None:
    """Inputs of a closure that are usually unknown; of a colour that is computed, the colours that
    it is made of."""
    widths = {row.name: row.width for row in rows}
    for name in _USUAL[kind]:
        found = tree.shader.constants_behind([registers[name]])
        if registers[name].kind != "constant":
            found &= tree.colors if widths[name] == 3 else set()
        tree.usual += sorted(found - set(tree.usual))


def _nearest(tree: Tree, item: _Found) -> Closure:
    """A diffuse shader in place of one that is not modelled, of what its Color gives."""
    node, groups = item.node, item.groups
    color = next((x.name for x in node.inputs if x.type == "RGBA" and x.enabled), "")
    _approximate(
        tree,
        node,
        f"{nodes.describe(node)} is a shader that is not modelled: it is rendered as diffuse",
    )
    given = {row.name: tree.shader.literal(0) for row in closure_rows()["diffuse"]}
    given["color"] = tree.get(node, color, groups) if color else tree.shader.literal(0.8)
    return Closure("diffuse", given, item.weight, tree.base_normal, shut=tuple(sorted(item.shut)))


def _approximate(tree: Tree, node: Node, sentence: str) -> None:
    """Notes that a node is rendered in another way."""
    assert tree.room.approximations is not None  # noqa: S101 - the caller has asked
    tree.approximated.append(node)
    tree.room.approximations.append(f"{tree.title}: {sentence}; it cannot be fitted")


def _subsurface(node: Node) -> str:
    if node.bl_idname == "ShaderNodeSubsurfaceScattering":
        return "RANDOM_WALK_SKIN" if node.falloff == "RANDOM_WALK_SKIN" else "RANDOM_WALK"
    if node.bl_idname == "ShaderNodeBsdfPrincipled":
        return hosts.subsurface_method(node)
    return "RANDOM_WALK"


def _judge(tree: Tree, node: Node, groups: Groups) -> None:
    """Settings of a closure that are not modelled."""
    distribution = getattr(node, "distribution", "GGX")
    if node.bl_idname == "ShaderNodeBsdfSheen":
        if distribution != "MICROFIBER":
            tree.refuse(node, f"{{}} has the distribution {distribution}", "set it to Microfiber")
    elif distribution not in _DISTRIBUTIONS:
        tree.refuse(node, f"{{}} has the distribution {distribution}", "set it to GGX")
    if node.bl_idname == "ShaderNodeSubsurfaceScattering" and node.falloff == "BURLEY":
        tree.refuse(node, "{} has the method Christensen-Burley", "set it to Random Walk")
    coat = "Coat Normal" if "Coat Normal" in node.inputs else "Clearcoat Normal"
    if tree.is_linked(node, coat, groups):
        tree.refuse(node, f"{{}} has its '{coat}' linked, which is not modelled", "unlink it")
