# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: the Principled BSDF behind the Material Output, its values, and why not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

from ... import parameters
from ...messages import remark, thing
from ...parameters import Parameter, Values
from ...problems import Problem, Reason
from .. import hosts
from ..baking.wanted import UV_NAME, WantedMaterial
from ..values import MaterialValues, Owner
from . import images, nodes, textures, volumes
from .graph.displacement import read_displacement
from .graph.surface import compile_surface
from .graph.tree import Tree, offered
from .nodes import Groups, Source, Unreadable
from .textures import EmptyRoom, TextureRoom

PRINCIPLED = "ShaderNodeBsdfPrincipled"
NO_MATERIAL = "(no material)"
_NORMALS = ("Normal", "Coat Normal", "Clearcoat Normal")
#: Inputs of Blender 4 that a Principled BSDF has in a graph alone, and that act above 0.
_ONLY_IN_GRAPHS = ("Anisotropic", "Thin Film Thickness")


@dataclass
class MaterialRead:
    """One material as it was understood."""

    values: MaterialValues
    owner: Owner
    problems: list[Problem]
    warnings: list[str]
    room: TextureRoom
    computed: bool = False  # an input is fed by nodes that are no image


def grey_material(name: str, color: Values = (0.8, 0.8, 0.8)) -> MaterialValues:
    """What Cycles renders where there is no material or no nodes: a Lambertian surface."""
    values = {"base_color": color, "specular_level": (0.0,)}
    return MaterialValues(name, values, multi_ggx=True, flavour="v2")


_IS_GRAPH = Reason("the surface is a graph of nodes", "name one of its inputs")


def principled_of(material: bpy.types.Material) -> tuple[bpy.types.Node, Groups] | str:
    """The Principled BSDF that Cycles renders and the groups around it, or why there is none."""
    output = nodes.output_of(material.node_tree)
    if output is None:
        return "has no Material Output node for Cycles"
    source = output.source("Surface")
    if source.node is None:
        return "has nothing linked to the Surface of its Material Output"
    if source.node.bl_idname != PRINCIPLED:
        return f"is made of {nodes.describe(source.node)}, not of a Principled BSDF"
    return source.node, source.groups


def _has_volume(material: bpy.types.Material) -> bool:
    """Whether Cycles takes it for a volume; then its transparent shadows cannot be switched off."""
    output = nodes.output_of(material.node_tree)
    return output is not None and output.source("Volume").node is not None


def _is_volume_alone(material: bpy.types.Material) -> bool:
    output = nodes.output_of(material.node_tree)
    return _has_volume(material) and output.source("Surface").node is None


def find_source(material: bpy.types.Material, parameter: Parameter) -> tuple[Source | None, Reason]:
    """Where the value of `parameter` sits, and why it cannot be written ("" if it can)."""
    if not material.use_nodes or material.node_tree is None:
        return None, Reason("the material does not use nodes", "switch on Use Nodes")
    if (parameter.owner, parameter.name) not in parameters.table():  # a constant of its graph
        source = graph_of(material, EmptyRoom()).sources.get(parameter.name)
        if source is None:
            return None, Reason("the node is gone or feeds nothing any more", "undo its change")
        return source, nodes.why_constant_fixed(source, material)
    found = principled_of(material)
    if isinstance(found, str):
        return None, Reason(f"the material {found}")
    return _source(material, *found, parameter)


def read_material(material: bpy.types.Material, name: str, room: TextureRoom) -> MaterialRead:
    """Reads one original (not evaluated) material. Units are those of the sockets."""
    library = material.library.filepath if material.library is not None else ""
    table = parameters.of("material")
    title = thing("Material", material.name)
    if not material.use_nodes or material.node_tree is None:
        reason = Reason("the material does not use nodes", "switch on Use Nodes")
        values = grey_material(name, tuple(material.diffuse_color[:3]))
        fixed = {parameter.name: reason for parameter in table}
        owner = Owner(name, "material", material.name, library, values.values, fixed)
        return MaterialRead(values, owner, [], [], room)

    if _is_volume_alone(material):
        fixed = {
            parameter.name: Reason("the material has no surface")
            for parameter in table
            if parameter.name not in volumes.PARAMETERS
        }
        owner = Owner(name, "material", material.name, library, {}, fixed)
        values = MaterialValues(name, {"alpha": (0.0,)}, multi_ggx=True, flavour="v2")
        read = MaterialRead(values, owner, _other_outputs(material, title), [], room)
        _read_volume(material, title, read)
        read.values.values.update(owner.values)
        return read

    found = principled_of(material)
    if isinstance(found, str) or needs_graph(material, *found):
        return read_graph(material, name, room)
    node, groups = found
    read = MaterialRead(
        MaterialValues(
            name,
            {},
            multi_ggx=node.distribution == "MULTI_GGX",
            flavour=hosts.flavour(),
            subsurface=hosts.subsurface_method(node),
            transparent_shadows=_has_volume(material) or hosts.transparent_shadows(material),
        ),
        Owner(name, "material", material.name, library, {}, {}),
        [],
        [],
        room,
    )
    for parameter in table:
        if parameter.name not in volumes.PARAMETERS:
            _read_parameter(material, node, groups, parameter, title, read)
    if read.computed or (read.problems and (room.baker or room.approximations is not None)):
        return read_graph(material, name, room)
    _read_volume(material, title, read)
    read.values.values.update(read.owner.values)
    return read


def needs_graph(material: bpy.types.Material, node: bpy.types.Node, groups: Groups) -> bool:
    """Whether a Principled BSDF alone does not say what the surface is like."""
    for name in _ONLY_IN_GRAPHS if not hosts.is_version_3() else ():
        if name not in node.inputs:
            continue
        value = nodes.constant(nodes.source_of(node.inputs[name], groups))
        if value is None or value[0] > 0:
            return True
    normals = [node.inputs[name] for name in _NORMALS if name in node.inputs]
    output = nodes.output_of(material.node_tree)
    linked = [*(nodes.source_of(item, groups) for item in normals)]
    return any(source.node is not None for source in (*linked, output.source("Displacement")))


def graph_of(material: bpy.types.Material, room: TextureRoom, name: str = "") -> Tree:
    """The program of a material with nodes, or its problems; an empty one without an output. name:
    as in `read_material`."""
    output = nodes.output_of(material.node_tree)
    tree = Tree(thing("Material", material.name), room, material_index=material.pass_index)
    tree.baked_uv = UV_NAME + name
    if output is None:
        return tree
    read_displacement(tree, output.source("Displacement"), material)
    compile_surface(tree, output.source("Surface"))
    bent = any(item.normal is not None for item in tree.shader.closures)
    if bent and not hosts.bump_map_correction(material):
        cause = "its Bump Map Correction is off, which leaves bent normals as they are"
        cure = "switch on Settings > Surface > Bump Map Correction of the material"
        tree.problems.append(Problem(tree.title, cause, cure))
    return tree


def read_graph(material: bpy.types.Material, name: str, room: TextureRoom) -> MaterialRead:
    """A material whose surface is a graph of closures."""
    title = thing("Material", material.name)
    library = material.library.filepath if material.library is not None else ""
    values = MaterialValues(
        name,
        {},
        multi_ggx=True,
        flavour=hosts.flavour(),
        transparent_shadows=_has_volume(material) or hosts.transparent_shadows(material),
    )
    if nodes.output_of(material.node_tree) is None:
        problem = Problem(title, "has no Material Output node for Cycles", "add one")
        owner = Owner(name, "material", material.name, library, {}, {})
        return MaterialRead(grey_material(name), owner, [problem], [], room)
    tree = graph_of(material, room, name)
    usual = tuple(dict.fromkeys(tree.usual))
    owner = Owner(name, "material", material.name, library, {}, {}, usual=usual)
    problems = list(tree.problems)
    if problems and room.approximations is not None:
        return _plain(material, name, problems, room)
    if tree.baked and room.baker is not None:
        wanted = WantedMaterial(name, material.name, library, tree.shader, tree.baked)
        room.baker.materials.append(wanted)
    if problems:  # what lies behind a node that is refused is said at once
        said = {item.object for item in problems}
        missing = images.missing_in(material.node_tree)
        problems += [_of(item, title) for item in missing if item.object not in said]
    warnings = [remark(title, text) for text in tree.warnings]
    read = MaterialRead(replace(values, shader=tree.shader), owner, problems, warnings, room)
    for parameter in parameters.of("material"):
        if parameter.name not in volumes.PARAMETERS:
            owner.fixed[parameter.name] = _IS_GRAPH
    fixed = tree.shader.fixed_directions()
    for item in tree.shader.constants:
        owner.parameters[item.parameter.name] = item.parameter
        owner.values[item.parameter.name] = item.value
        source = tree.sources[item.parameter.name]
        reason = nodes.why_constant_fixed(source, material)
        if source.socket.node in tree.approximated:
            reason = reason or Reason("its shader is approximated", "use one that is read")
        reason = reason or fixed.get(item.parameter.name, Reason())
        if item.parameter.name in tree.one_sided:
            reason = reason or (
                Reason(
                    "it leaves out a shader that cannot be rendered",
                    "set it between 0 and 1 to see why",
                )
            )
        if reason:
            owner.fixed[item.parameter.name] = reason
    _read_volume(material, title, read)
    medium = {key: owner.values[key] for key in volumes.PARAMETERS if key in owner.values}
    read.values.values.update(medium)
    return read


def _plain(
    material: bpy.types.Material, name: str, problems: list[Problem], room: TextureRoom
) -> MaterialRead:
    """A diffuse material of the colour that the viewport shows, in place of one that is not read
    at all."""
    title = thing("Material", material.name)
    library = material.library.filepath if material.library is not None else ""
    assert room.approximations is not None  # noqa: S101 - the caller has asked
    cause = problems[0].cause
    room.approximations.append(
        remark(
            title, f"it is rendered as diffuse of its viewport colour and cannot be fitted: {cause}"
        )
    )
    values = grey_material(name, tuple(material.diffuse_color[:3]))
    reason = Reason("the material is approximated", "use nodes that are read")
    fixed = {parameter.name: reason for parameter in parameters.of("material")}
    owner = Owner(name, "material", material.name, library, values.values, fixed)
    return MaterialRead(values, owner, [], [], room)


def _source(
    material: bpy.types.Material, node: bpy.types.Node, groups: Groups, parameter: Parameter
) -> tuple[Source | None, Reason]:
    socket = parameter.find(node)
    if socket is None:
        return None, Reason("this Blender's Principled BSDF has no such input")
    if hosts.node_version() not in parameter.versions:
        return None, Reason("it is not modelled for this Blender's Principled BSDF")
    source = nodes.source_of(socket, groups)
    width = 3 if socket.type in {"RGBA", "VECTOR"} else 1
    if width != parameter.width:
        # Blender 3's Specular Tint, a number: rendered, though not fitted. It is 0 unless set.
        reason = Reason(f"the input '{socket.name}' of this Blender is of another kind")
        return (source if nodes.constant(source) is not None else None), reason
    reason = nodes.why_not_writable(source, material)
    if parameter.name == "base_color" and isinstance(source.node, bpy.types.ShaderNodeTexImage):
        reason = Reason(reason.cause, f"{reason.cure}, or fit base_color_texture")
    return source, reason


def _read_parameter(
    material: bpy.types.Material,
    node: bpy.types.Node,
    groups: Groups,
    parameter: Parameter,
    title: str,
    read: MaterialRead,
) -> None:
    source, reason = _source(material, node, groups, parameter)
    if reason:
        read.owner.fixed[parameter.name] = reason
    if source is None:
        socket = parameter.find(node) if hosts.node_version() in parameter.versions else None
        if socket is not None:  # linked
            read.warnings.append(remark(title, f"input '{socket.name}' is left out: {reason}"))
            read.owner.values[parameter.name] = (0.0,) * parameter.width
        return
    label = parameter.find(node).name
    value = nodes.constant(source)
    if value is None:
        _read_map(source, parameter, label, title, read)
        return
    value = nodes.broadcast(value, parameter.width)
    complaint = parameter.complaint(value)
    if complaint:
        problem = Problem(title, f"input '{label}': {complaint}", "set a value inside the range")
        read.problems.append(problem)
        return
    read.owner.values[parameter.name] = value


def _of(problem: Problem, place: str) -> Problem:
    """With the place in the material that it concerns."""
    return Problem(problem.object, f"{problem.cause} (for {place})", problem.cure)


def _read_map(
    source: Source, parameter: Parameter, label: str, title: str, read: MaterialRead
) -> None:
    """A linked input: a texture, a colour attribute, or a problem that names the node."""
    try:
        found = read.room.read_map(source, title)
    except Unreadable as error:
        problem = offered(error.problem, source)
        read.computed |= problem.object == title
        place = f"input '{label}'" if problem.object == title else f"input '{label}' of {title}"
        read.problems.append(_of(problem, place))
        return
    if found is None:
        read.computed = True
        return
    read.values.maps[parameter.name] = found
    read.values.values[parameter.name] = textures.typical_value(parameter, found)
    excess = textures.excess(parameter, found)
    if excess:
        read.warnings.append(remark(title, f"input '{label}': {excess}"))


def _read_volume(material: bpy.types.Material, title: str, read: MaterialRead) -> None:
    _, reason = volumes.find_node(material)
    if reason:
        read.owner.fixed.update(dict.fromkeys(volumes.PARAMETERS, reason))
    output = nodes.output_of(material.node_tree)
    assert output is not None  # noqa: S101 - the caller has seen it
    source = output.source("Volume")
    if not volumes.has_medium(source):
        return
    try:
        found = volumes.read(source, title)
    except Unreadable as error:
        read.problems.append(error.problem)
        return
    read.owner.values.update(found)


def _other_outputs(material: bpy.types.Material, title: str) -> list[Problem]:
    output = nodes.output_of(material.node_tree)
    source = output.source("Displacement")
    if source.node is None:
        return []
    cause = (
        f"its Displacement is linked to {nodes.describe(source.node)}, "
        "which this version does not render"
    )
    return [Problem(title, cause, "unlink the Displacement of the Material Output")]
