# SPDX-License-Identifier: GPL-3.0-or-later
"""The Surface of a material as a list of closures, each with its share of the mixture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import bpy

from .... import native
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
#: Inputs that act only if they are not 0, and are not modelled.
_WITHOUT = ("Thin Film Thickness",)
#: Distributions of micronormals that are rendered; SHARP is Blender 3's.
_DISTRIBUTIONS = {"GGX", "MULTI_GGX", "BECKMANN", "ASHIKHMIN_SHIRLEY", "SHARP"}
_CURE = "use a Principled BSDF, or another shader that is read"


@lru_cache(maxsize=1)
def closure_rows() -> dict[str, list[Parameter]]:
    """The parameters of each kind of closure. Raises NativeUnavailable."""
    return {kind: [row_of(row) for row in rows] for kind, rows in native.core().closures().items()}


@dataclass
class _Found:
    """A closure's node, and by what shares of the whole it is reached."""

    node: Node
    groups: Groups
    weight: Register | None


def compile_surface(tree: Tree, source: Source) -> None:
    """Fills `tree.shader` with what `source`, the Surface of an output, is linked to."""
    tree.shader.flavour = hosts.flavour()
    found: dict[tuple[int, ...], _Found] = {}
    _walk(tree, source, None, found)
    if len(found) > MOST_CLOSURES:
        first = next(iter(found.values()))
        cause = (
            f"{{}} is one of {len(found)} shaders of one surface, of which {MOST_CLOSURES} are read"
        )
        tree.refuse(first.node, cause, "mix fewer shaders")
    for item in found.values():
        closure = _closure(tree, item)
        if closure is not None:
            tree.shader.closures.append(closure)


def _walk(
    tree: Tree,
    source: Source,
    weight: Register | None,
    found: dict[tuple[int, ...], _Found],
) -> None:
    node, groups = source.node, source.groups
    if node is None or source.socket.type != "SHADER":
        return  # nothing: black
    if node.bl_idname in {MIX, ADD}:
        _walk_mixture(tree, node, groups, weight, found)
        return
    key = (node.as_pointer(), *(group.as_pointer() for group in groups))
    if key not in found:
        found[key] = _Found(node, groups, weight)
    else:
        one = tree.shader.literal(1)
        sum_of = (found[key].weight or one, weight or one)
        found[key].weight = tree.math("ADD", *sum_of)


def _walk_mixture(
    tree: Tree,
    node: Node,
    groups: Groups,
    weight: Register | None,
    found: dict[tuple[int, ...], _Found],
) -> None:
    shaders = [item for item in node.inputs if item.type == "SHADER"]
    sources = [nodes.source_of(item, groups) for item in shaders]
    if node.bl_idname == ADD:
        for source in sources:
            _walk(tree, source, weight, found)
        return
    factor = nodes.constant(nodes.source_of(node.inputs[0], groups))
    if factor is not None and not 0 < factor[0] < 1:  # one of the two is not there
        _walk(tree, sources[factor[0] >= 1], weight, found)
        return
    # Cut off even where Blender permits no other number: the factor may be linked.
    zero, one = tree.shader.literal(0), tree.shader.literal(1)
    second = tree.math("ADD", tree.value(node.inputs[0], groups), zero, clamp=True)
    first = tree.math("SUBTRACT", one, second)
    for share, source in zip((first, second), sources, strict=True):
        inner = share if weight is None else tree.math("MULTIPLY", weight, share)
        _walk(tree, source, inner, found)


def _closure(tree: Tree, item: _Found) -> Closure | None:
    node, groups = item.node, item.groups
    kind = _KINDS.get(node.bl_idname)
    if kind is None:
        tree.refuse(node, "{} is a shader that is not modelled", _CURE)
        return None
    _judge(tree, node, groups)
    if kind == "metallic" and node.fresnel_type == "PHYSICAL_CONDUCTOR":
        kind = "conductor"
    rows = closure_rows()[kind]
    version = hosts.flavour()
    registers = {
        row.name: tree.parameter(node, row, groups)
        if version in row.versions
        else tree.shader.literal(*(0.0,) * row.width)
        for row in rows
    }
    distribution = getattr(node, "distribution", "GGX")
    if distribution == "SHARP":  # Blender 3
        registers["roughness"] = tree.shader.literal(0)
    if distribution not in _DISTRIBUTIONS or distribution == "SHARP":  # sheen has others
        distribution = "GGX"
    tangent = None
    if "anisotropy" in registers and node.bl_idname != "ShaderNodeSubsurfaceScattering":
        if tree.number_of(node, "Anisotropy", groups) == 0:
            registers["anisotropy"] = tree.shader.literal(0)  # two widths that stay one
        else:
            tangent = tangent_of(tree, node, groups)
    return Closure(
        kind,
        registers,
        item.weight,
        tree.normal(node, groups),
        tangent,
        distribution=distribution,
        subsurface=_subsurface(node),
    )


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
    if node.bl_idname != "ShaderNodeBsdfPrincipled":  # of that, the table of properties warns
        for name in _WITHOUT:
            if tree.number_of(node, name, groups) not in {0.0}:
                tree.refuse(
                    node, f"{{}} has the input '{name}', which is not modelled", "set it to 0"
                )
    coat = "Coat Normal" if "Coat Normal" in node.inputs else "Clearcoat Normal"
    if tree.is_linked(node, coat, groups):
        tree.refuse(node, f"{{}} has its '{coat}' linked, which is not modelled", "unlink it")
