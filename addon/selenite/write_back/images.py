# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted images of a material's parameters -> Image Texture nodes that Cycles renders.

What stood in the node tree before is noted on the material, for `restore`, by the names of nodes:
after an undo every pointer that Python holds is stale. Each `show` adds a note, `restore` takes the
newest away.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

import bpy

from .. import parameters
from ..messages import thing
from ..parameters import Parameter
from ..problems import BadInput, Problem, Reason
from ..scene_read import hosts
from ..scene_read.shading import materials, nodes
from ..scene_read.shading.graph.tree import parted
from ..scene_read.shading.nodes import Groups
from ..scene_read.values import SceneValues
from . import datablock

if TYPE_CHECKING:
    from ..scene_read.hosts import BpyStruct

_BEFORE = "selenite_image_before"
_MATERIAL = "selenite_image_material"
#: With the number of a note: holds the image that was replaced. A custom property counts as a user,
#: so that Blender saves the image though no node has it any more; Blender itself keeps the property
#: right through undo.
_REPLACED = "selenite_image_replaced"
#: Marks the images that were loaded here, which go when nobody uses them any more.
_LOADED = "selenite_loaded"

#: By kind of file: what Blenders call its colour space, and whether an image has it.
_SPACES: dict[str, tuple[tuple[str, ...], Callable[[bpy.types.Image], bool]]] = {
    ".png": (("sRGB", "sRGB OETF"), hosts.is_srgb),
    ".exr": (("Linear Rec.709", "Linear", "Linear BT.709"), hosts.is_linear),
}
#: The same of a number: nothing decodes it.
_DATA_SPACE = (("Non-Color", "Generic Data", "Raw"), hosts.is_data)
_IMAGE_NODE = "ShaderNodeTexImage"
_NODE_SETTINGS = ("projection", "projection_blend", "interpolation", "extension", "label", "width")


@dataclass(frozen=True)
class _Inlet:
    """An input on the way to that of a parameter. `alone`: what is linked here reaches nothing
    else."""

    socket: bpy.types.NodeSocket
    groups: Groups
    alone: bool


def show(values: SceneValues, name: str, path: str, parameter: str = "base_color") -> str:
    """Gives the input of material `name` (its owner's name in `values.owners`) that has this
    parameter the image file at `path`: .png with sRGB code values, or .exr, linear; of a number, as
    it is. Returns what was done.

    An Image Texture that feeds nothing else gets the image, one that does gets a copy beside it,
    and whatever else stands there makes room for a new one. Raises BadInput, and then nothing has
    changed.
    """
    title = thing("Material", name)
    owner = values.owners.get(name)
    material = datablock(bpy.data.materials, owner) if owner is not None else None
    if material is None:
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    row = parameters.table()["material", parameter]
    node, inlet = _place(material, title, row)
    path = str(Path(path).absolute())
    image = _load(path, is_data=row.width == 1)

    notes = json.loads(material.get(_BEFORE, "[]"))
    done = f"{title} now takes its {row.sockets[0]} from {path}"
    if inlet is not None:
        tree, old, end = _tree_around(inlet.socket), node, inlet.socket.node
        note = _note(material, tree) | {
            "inlet": [end.name, inlet.socket.identifier],
            "link": _link(inlet.socket),
        }
        node = _new_node(tree, end) if old is None else _copied_node(tree, old)
        tree.links.new(node.outputs["Color"], inlet.socket)
        kind = "a new one" if old is None else f"a copy of '{old.name}'"
        done += f" (node '{node.name}', {kind})"
    else:
        note = _note(material, _tree_around(node))
        if node.image is not None:
            material[f"{_REPLACED}_{len(notes)}"] = node.image
        done += f" (node '{node.name}')"
    node.image = image
    material[_BEFORE] = json.dumps([*notes, note | {"node": node.name}])
    material[_MATERIAL] = name
    _drop_unused()
    return done


def show_colors(values: SceneValues, name: str, attribute: str) -> None:
    """Gives the base colour of material `name` a colour attribute in place of what stands there;
    `restore` undoes it too. Raises BadInput, and then nothing has changed."""
    title = thing("Material", name)
    owner = values.owners.get(name)
    material = datablock(bpy.data.materials, owner) if owner is not None else None
    if material is None:
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    _, inlet = _place(material, title, parameters.table()["material", "base_color"])
    if inlet is None:
        raise BadInput(Problem(title, "its base colour is an image", "undo that"))
    tree, end = _tree_around(inlet.socket), inlet.socket.node
    note = _note(material, tree) | {
        "inlet": [end.name, inlet.socket.identifier],
        "link": _link(inlet.socket),
    }
    node = _add_node(tree, end, (-300, 0), "ShaderNodeVertexColor")
    cast("BpyStruct", node).layer_name = attribute
    tree.links.new(node.outputs["Color"], inlet.socket)
    notes = json.loads(material.get(_BEFORE, "[]"))
    material[_BEFORE] = json.dumps([*notes, note | {"node": node.name}])
    material[_MATERIAL] = name


def show_in_node(values: SceneValues, name: str, path: str, node: str) -> str:
    """The same for the Image Texture of that name in the graph of a material, behind the names of
    the groups around it: GROUP/NODE."""
    title = f"Material '{name}'"
    owner = values.owners.get(name)
    material = datablock(bpy.data.materials, owner) if owner is not None else None
    if material is None:
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    found, groups = _node_named(material, node, title)
    if reason := _why_fixed(material, groups, f"image of '{node}'"):
        raise BadInput(reason.problem(title, ""))
    path = str(Path(path).absolute())
    is_data = found.image is not None and hosts.is_data(found.image)
    image = _load(path, is_data=is_data)
    notes = json.loads(material.get(_BEFORE, "[]"))
    if found.image is not None:
        material[f"{_REPLACED}_{len(notes)}"] = found.image
    note = _note(material, _tree_around(found)) | {"node": found.name}
    found.image = image
    material[_BEFORE] = json.dumps([*notes, note])
    material[_MATERIAL] = name
    _drop_unused()
    return f"{title} now takes its image of '{node}' from {path}"


def _node_named(
    material: bpy.types.Material, name: str, title: str
) -> tuple[bpy.types.ShaderNodeTexImage, Groups]:
    """Raises BadInput."""
    tree, rest = material.node_tree, name
    groups: Groups = ()
    while tree is not None:
        for node in tree.nodes:
            if isinstance(node, bpy.types.ShaderNodeTexImage) and parted(node.name) == rest:
                return node, groups
        within = (
            node
            for node in tree.nodes
            if node.bl_idname == "ShaderNodeGroup" and rest.startswith(f"{parted(node.name)}/")
        )
        group = next(within, None)
        if group is None:
            break
        tree, rest = group.node_tree, rest.removeprefix(f"{parted(group.name)}/")
        groups = (*groups, group)
    raise BadInput(Problem(title, f"its node '{name}' is gone", "undo its removal"))


def restore(name: str) -> None:
    """Undoes the newest `show` for the material noted under that name; what is gone meanwhile is
    passed over."""
    for material in bpy.data.materials:
        if material.get(_MATERIAL) == name and hosts.is_editable(material):
            _undo(material)
    _drop_unused()


def _place(
    material: bpy.types.Material, title: str, row: Parameter
) -> tuple[bpy.types.ShaderNodeTexImage | None, _Inlet | None]:
    """The Image Texture that feeds a parameter's input, if one does, and where another one is to be
    linked; None: only its image is to be replaced. Raises BadInput."""
    way = _way(material, title, row)
    label = row.sockets[0]
    source = nodes.source_of(way[-1].socket, way[-1].groups)
    node = source.node
    if not isinstance(node, bpy.types.ShaderNodeTexImage) or source.socket.identifier != "Color":
        reasons = [_why_fixed(material, inlet.groups, label) for inlet in way]
        found = (i for i, why in zip(way, reasons, strict=True) if i.alone and not why)
        inlet = next(found, None)
        if inlet is None:
            raise BadInput(reasons[0].problem(title, ""))
        return None, inlet
    reason = _why_fixed(material, source.groups, label)
    if reason:
        raise BadInput(reason.problem(title, ""))
    used = len(source.socket.links) + len(node.outputs["Alpha"].links)
    if way[-1].alone and used == 1:
        return node, None
    # A copy has the same vector, so that it has to stand in the same tree.
    here = (item for item in way if item.alone and item.socket.id_data == node.id_data)
    inlet = next(here, None)
    if inlet is None:
        cause = f"{nodes.describe(node)} feeds other inputs too, through a node group"
        raise BadInput(Problem(title, cause, f"give the {label} an Image Texture of its own"))
    return node, inlet


def _way(material: bpy.types.Material, title: str, row: Parameter) -> list[_Inlet]:
    """The inputs from that of a parameter up to where its value comes from, as `nodes.source_of`
    follows them. Raises BadInput."""
    if not material.use_nodes or material.node_tree is None:
        raise BadInput(Problem(title, "it does not use nodes", "switch on Use Nodes"))
    found = materials.principled_of(material)
    if isinstance(found, str):
        cure = "connect a Principled BSDF to the Surface of the output"
        raise BadInput(Problem(title, found, cure))
    principled, groups = found
    socket = row.find(principled)
    if socket is None:
        cause = f"its Principled BSDF has no {row.sockets[0]}"
        raise BadInput(Problem(title, cause, "undo the change of its version"))
    way = [_Inlet(socket, groups, True)]
    while (link := nodes.link_of(socket)) is not None:
        node, output = link.from_node, link.from_socket
        inner = nodes.passed_on(node, output, groups)
        if inner is None:
            break
        uses = len(output.links)
        if node.mute:
            ends = [item.to_socket for item in node.internal_links if item.from_socket == inner[0]]
            uses = sum(len(item.links) for item in ends)
        elif node.bl_idname == "NodeGroupInput":
            # A group may have several Group Input nodes.
            entries = [
                item for item in _tree_around(node).nodes if item.bl_idname == "NodeGroupInput"
            ]
            same = [_by_identifier(item.outputs, output.identifier) for item in entries]
            uses = sum(len(item.links) for item in same if item is not None)
        socket, groups = inner
        way.append(_Inlet(socket, groups, way[-1].alone and uses == 1))
    return way


def _why_fixed(material: bpy.types.Material, groups: Groups, label: str) -> Reason:
    """Why the innermost tree of `groups` cannot be changed for this material alone; empty if it
    can."""
    if reason := nodes.why_owner_fixed(material):
        return reason.after("it is ")
    for group in groups:
        if not hosts.is_editable(group.node_tree):
            place = f"its {label} comes from inside node group '{group.node_tree.name}'"
            return Reason(f"{place} of a library", "make the group local")
    shared = nodes.why_shared(groups)
    return shared.after(f"its {label} comes from ")


def _load(path: str, *, is_data: bool) -> bpy.types.Image:
    """The file as an image of Blender's, as it is on disk now, without alpha. Raises BadInput."""
    title = thing("Image", path)
    suffix = Path(path).suffix.lower()
    if suffix not in _SPACES:
        raise BadInput(Problem(title, "it is neither .png nor .exr", "write it as one of these"))
    if not Path(path).is_file():
        raise BadInput(
            Problem(title, "the file does not exist", "put it back or run the fit again")
        )
    spaces, has_space = _DATA_SPACE if is_data else _SPACES[suffix]
    count = len(bpy.data.images)
    try:
        image = bpy.data.images.load(path, check_existing=True)
        if len(bpy.data.images) == count:
            # Somebody's image with other settings, or painted on, stays as it is.
            if _is_plain(image) and has_space(image):
                image.reload()
            else:
                image = bpy.data.images.load(path)
    except RuntimeError as error:
        cause = f"cannot be read ({str(error).removeprefix('Error: ').strip()})"
        raise BadInput(Problem(title, cause, "check its permissions")) from error
    is_new = len(bpy.data.images) > count
    if is_new:
        image[_LOADED] = True
        image.alpha_mode = "NONE"
        settings = cast("BpyStruct", image.colorspace_settings)
        known = [item.identifier for item in settings.bl_rna.properties["name"].enum_items]
        settings.name = next((item for item in spaces if item in known), settings.name)
    problem = None
    if not has_space(image):
        cause = f"this Blender's colour management has no {' or '.join(spaces)}"
        problem = Problem(title, cause, "use the one that Blender comes with")
    elif 0 in image.size or not len(cast("BpyStruct", image.pixels)):
        problem = Problem(title, "it cannot be read as an image", "run the fit again")
    if problem is not None:
        if is_new:
            bpy.data.images.remove(image)
        raise BadInput(problem)
    return image


def _is_plain(image: bpy.types.Image) -> bool:
    """Whether an image is its file and nothing else."""
    return (
        hosts.is_editable(image)
        and image.source == "FILE"
        and not image.packed_file
        and not image.is_dirty
        and image.alpha_mode == "NONE"
    )


def _drop_unused() -> None:
    for image in [item for item in bpy.data.images if item.get(_LOADED) and not item.users]:
        bpy.data.images.remove(image)


def _new_node(tree: bpy.types.NodeTree, end: bpy.types.Node) -> bpy.types.ShaderNodeTexImage:
    """An Image Texture left of the node that it will feed."""
    node = cast(bpy.types.ShaderNodeTexImage, _add_node(tree, end, (-300, 0), _IMAGE_NODE))
    node.projection, node.interpolation, node.extension = "FLAT", "Linear", "REPEAT"
    return node


def _copied_node(
    tree: bpy.types.NodeTree, old: bpy.types.ShaderNodeTexImage
) -> bpy.types.ShaderNodeTexImage:
    """An Image Texture that looks up at the same place in the same way, below the old one."""
    node = cast(bpy.types.ShaderNodeTexImage, _add_node(tree, old, (0, -300), _IMAGE_NODE))
    for name in _NODE_SETTINGS:
        setattr(node, name, getattr(old, name))
    for item in old.texture_mapping.bl_rna.properties:
        if not item.is_readonly:
            value = getattr(old.texture_mapping, item.identifier)
            setattr(node.texture_mapping, item.identifier, value)
    for link in old.inputs["Vector"].links:
        if not link.is_muted:
            tree.links.new(link.from_socket, node.inputs["Vector"])
    return node


def _add_node(
    tree: bpy.types.NodeTree, neighbour: bpy.types.Node, offset: tuple[float, float], kind: str
) -> bpy.types.Node:
    node = tree.nodes.new(kind)
    node.select = False
    node.parent = neighbour.parent  # before the location, which is relative to it
    node.location = neighbour.location[0] + offset[0], neighbour.location[1] + offset[1]
    return node


def _tree_around(item: bpy.types.Node | bpy.types.NodeSocket) -> bpy.types.NodeTree:
    return cast(bpy.types.NodeTree, item.id_data)


def _note(material: bpy.types.Material, tree: bpy.types.NodeTree) -> dict[str, object]:
    """The head of a note; "" stands for the material's own tree."""
    return {"group": "" if tree == material.node_tree else tree.name}


def _tree(material: bpy.types.Material, before: dict[str, object]) -> bpy.types.NodeTree | None:
    if not before["group"]:
        return material.node_tree
    groups = [item for item in bpy.data.node_groups if hosts.is_editable(item)]
    return next((item for item in groups if item.name == before["group"]), None)


def _link(socket: bpy.types.NodeSocket) -> list[object] | None:
    """Node, output and muting of what is linked to an input."""
    link = next(iter(socket.links), None)
    if link is None:
        return None
    return [link.from_node.name, link.from_socket.identifier, bool(link.is_muted)]


def _undo(material: bpy.types.Material) -> None:
    """Puts back what the newest note says, and removes that. A link that somebody has made since
    stays."""
    *earlier, note = json.loads(material[_BEFORE])
    kept = f"{_REPLACED}_{len(earlier)}"
    had_image = kept in list(material.keys())
    replaced = material.get(kept)
    if had_image:
        del material[kept]
    if earlier:
        material[_BEFORE] = json.dumps(earlier)
    else:
        del material[_BEFORE], material[_MATERIAL]
    tree = _tree(material, note)
    if tree is None:
        return
    node: bpy.types.Node | None = tree.nodes.get(note["node"])
    if "inlet" not in note:
        is_gone = replaced is None and had_image
        if isinstance(node, bpy.types.ShaderNodeTexImage) and not is_gone:
            node.image = replaced
        return
    if node is not None:
        tree.nodes.remove(node)
    if note["link"] is None:
        return
    start, output, muted = note["link"]
    inlet = _socket(tree, "inputs", *note["inlet"])
    outlet = _socket(tree, "outputs", start, output)
    if inlet is not None and outlet is not None and not inlet.is_linked:
        tree.links.new(outlet, inlet).is_muted = muted


def _socket(
    tree: bpy.types.NodeTree, side: str, node: str, identifier: str
) -> bpy.types.NodeSocket | None:
    """By the names that are noted."""
    found: bpy.types.Node | None = tree.nodes.get(node)
    return _by_identifier(getattr(found, side), identifier) if found is not None else None


def _by_identifier(
    sockets: Iterable[bpy.types.NodeSocket], identifier: str
) -> bpy.types.NodeSocket | None:
    return next((item for item in sockets if item.identifier == identifier), None)
