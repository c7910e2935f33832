# SPDX-License-Identifier: GPL-3.0-or-later
"""Fitted grids -> OpenVDB files and the Volume objects that show them.

Cycles has no grids in a mesh. There the medium moves from the mesh into a Volume object of its own,
whose voxels end where the mesh does; a mesh that had nothing but its medium is hidden from renders.
What stood in the scene before is noted on the Volume object, for `restore`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import bpy
import numpy as np

from .. import parameters
from ..messages import thing
from ..paths import file_stems
from ..problems import BadInput, Problem, Reason
from ..scene_read import hosts, openvdb_files, volume_objects
from ..scene_read.openvdb_files import VdbError, VdbGrid
from ..scene_read.shading import nodes, volumes
from ..scene_read.shading.nodes import Unreadable
from ..scene_read.values import GridValues, Owner, SceneValues
from . import datablock, voxels

_BEFORE = "selenite_before"
_MATERIAL = "selenite_material"
#: Relative difference between channels that counts as grey.
_GREY = 1e-5


def why_not() -> Reason:
    """Why this Blender can show no fitted grid, "" if it can."""
    if openvdb_files.module() is None:
        return Reason(
            "this Blender has no OpenVDB module for Python",
            "use Blender 4.4 or newer, or install python3-openvdb",
        )
    return Reason()


def show(
    scene: bpy.types.Scene,
    values: SceneValues,
    name: str,
    grids: Mapping[str, GridValues],
    folder: Path,
) -> str:
    """Writes the grids of one material (use -> grid) to `<material>.vdb` in `folder`, and gives
    them to a Volume object. Returns what was done. Other values are those of the material's nodes.

    Raises BadInput, and then the scene is as before.
    """
    title = thing("Material", name)
    material = datablock(bpy.data.materials, values.owners[name])
    if material is None:
        raise BadInput(Problem(title, "it is gone", "undo its removal"))
    if not hosts.is_editable(material):
        raise BadInput(Problem(title, "it comes from a library", "make it local"))
    missing = why_not()
    if missing:
        raise BadInput(missing.problem(title, ""))
    path = str(folder / f"{file_stems(values.owners)[name]}.vdb")
    own = [
        item
        for item in scene.objects
        if item.type == "VOLUME" and material in [slot.material for slot in item.material_slots]
    ]
    if len(own) > 1:
        cause = "several Volume objects have it; each needs a grid of its own"
        raise BadInput(Problem(title, cause, "give each object its own material"))
    try:
        if own:
            before = volume_objects.write(own[0], material, grids, path)
            own[0][_BEFORE], own[0][_MATERIAL] = json.dumps(before), name
            return f"Object '{own[0].name}' now renders {path}"
        item = _new_volume(scene, values, name, material, grids, path)
    except Unreadable as error:
        raise BadInput(error.problem) from error
    except VdbError as error:
        raise BadInput(Problem(title, error.cause, error.cure)) from error
    item[_BEFORE], item[_MATERIAL] = json.dumps(_take_medium_out(material)), name
    return f"Object '{item.name}' shows {path} in place of the medium of '{name}'"


def may_show(item: str, material: str) -> bool:
    """Whether an object of that name may be one that `show` has made for a material."""
    return item.startswith(_object_name(material))


def shows(item: bpy.types.Object, material: str) -> bool:
    """Whether `show` has made it for a material."""
    return bool(item.get(_MATERIAL) == material)


def restore(scene: bpy.types.Scene, name: str) -> None:
    """Undoes `show` for one material; what is gone meanwhile is passed over."""
    for item in [item for item in scene.objects if shows(item, name)]:
        before = json.loads(item[_BEFORE])
        if "filepath" in before:
            material = item.material_slots[0].material
            volume_objects.put_back(item, material, before)
            del item[_BEFORE], item[_MATERIAL]
            continue
        for hidden in before["hidden"]:
            if hidden in bpy.data.objects:
                bpy.data.objects[hidden].hide_render = False
        owner = Owner(name, "material", before["material"], before["library"], {}, {})
        material = datablock(bpy.data.materials, owner)
        if material is not None and before["node"] in material.node_tree.nodes:
            output = material.node_tree.get_output_node("CYCLES")
            socket = material.node_tree.nodes[before["node"]].outputs[before["socket"]]
            material.node_tree.links.new(socket, output.inputs["Volume"])
        data, shown = item.data, item.material_slots[0].material
        assert isinstance(data, bpy.types.Volume), item.type
        bpy.data.objects.remove(item)
        bpy.data.volumes.remove(data)
        if shown is not None and not shown.users:
            bpy.data.materials.remove(shown)


def _object_name(material: str) -> str:
    return f"{material} grids"


def _new_volume(
    scene: bpy.types.Scene,
    values: SceneValues,
    name: str,
    material: bpy.types.Material,
    grids: Mapping[str, GridValues],
    path: str,
) -> bpy.types.Object:
    """A Volume object with the medium of the meshes that have the material."""
    title = thing("Material", name)
    output = material.node_tree.get_output_node("CYCLES") if material.node_tree else None
    if output is None:
        raise Unreadable(title, "it has no Material Output for Cycles", "add one")
    medium = volumes.read(nodes.source_of(output.inputs["Volume"]), title)
    extinction = np.array(medium["extinction"])
    if "albedo" in grids and np.ptp(extinction) > _GREY * extinction.max():
        cause = (
            f"its extinction is {', '.join(f'{x:g}' for x in extinction)}, and with an albedo grid "
            "Cycles renders a grey one only"
        )
        raise Unreadable(title, cause, "give it the same extinction in all channels")
    low, high, shape = _box(next(iter(grids.values())))
    sizes = voxels.fine_sizes(low, high, max(shape))
    density = voxels.filled(values, name, low, high, sizes)[..., None]
    if not density.any():
        raise Unreadable(title, "its meshes enclose nothing", "close them")
    if "density" in grids:
        density = density * voxels.sampled(grids["density"], low, high, sizes)
    from_unit = np.eye(4)
    from_unit[:3, :3], from_unit[:3, 3] = np.diag(high - low), low
    written = [VdbGrid("density", density, from_unit)]
    if "albedo" in grids:
        colours = voxels.sampled(grids["albedo"], low, high, sizes)
        colours = np.broadcast_to(colours, (*colours.shape[:3], 3))
        written.append(VdbGrid("albedo", colours, from_unit))
    openvdb_files.write(path, written)

    shown = bpy.data.materials.new(f"{name} grids")
    shown.use_nodes = True
    tree = shown.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeVolumePrincipled")
    end = tree.nodes.new("ShaderNodeOutputMaterial")
    end.location = (300, 0)
    tree.links.new(node.outputs[0], end.inputs["Volume"])
    node.inputs["Density Attribute"].default_value = "density"
    source = nodes.source_of(end.inputs["Volume"])
    for key in volumes.PARAMETERS:
        volumes.write(source, parameters.table()["material", key], medium[key])
    if "albedo" in grids:
        volume_objects.colour_from_grid(node, "albedo")
    data = bpy.data.volumes.new(f"{name} grids")
    data.filepath = path
    data.render.precision = "FULL"
    data.materials.append(shown)
    item = bpy.data.objects.new(_object_name(name), data)
    scene.collection.objects.link(item)
    return item


def _take_medium_out(material: bpy.types.Material) -> dict[str, object]:
    """Unlinks the volume of the material, and hides objects of which nothing is left (those that
    are instanced stand in no scene)."""
    output = material.node_tree.get_output_node("CYCLES")
    link = output.inputs["Volume"].links[0]
    before: dict[str, object] = {
        "material": material.name,
        "library": material.library.filepath if material.library is not None else "",
        "node": link.from_node.name,
        "socket": [item.identifier for item in link.from_node.outputs].index(
            link.from_socket.identifier
        ),
        "hidden": [],
    }
    material.node_tree.links.remove(link)
    if not output.inputs["Surface"].is_linked:
        gone = [
            item
            for item in bpy.data.objects
            if material in (found := [slot.material for slot in item.material_slots])
            and all(other in (None, material) for other in found)
            and hosts.is_editable(item)
            and not item.hide_render
        ]
        for item in gone:
            item.hide_render = True
        before["hidden"] = [item.name for item in gone]
    return before


def _box(grid: GridValues) -> tuple[np.ndarray, np.ndarray, tuple[int, ...]]:
    """Corners in the world of a box that is parallel to the axes, and the grid's voxels."""
    scale = np.diag(grid.to_unit)[:3]
    low = -grid.to_unit[:3, 3] / scale
    return low, low + 1 / scale, grid.values.shape[:3]
