# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place that knows how Blender 3.4, 4.x and 5.x differ."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import bpy
import numpy as np

#: A struct whose properties depend on its kind, or on the version of Blender: the stubs of bpy know
#: those of the base class, in one version.
BpyStruct = Any

_LINEAR_NAMES = {"Linear", "Linear Rec.709", "Linear BT.709", "Non-Color", "Raw", "Generic Data"}
_SRGB_NAMES = {"sRGB", "sRGB OETF"}


def is_version_3() -> bool:
    """Blender 3.x: Principled version 1, other light units."""
    return bpy.app.version < (4, 0, 0)


def path_options() -> set[str]:
    """Of a property that holds a path, which may begin with "//", the folder of the .blend."""
    relative = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()
    return {"ANIMATABLE"} | relative


def node_version() -> str:
    """Which Principled BSDF this Blender has."""
    return "v1" if is_version_3() else "v2"


def flavour() -> str:
    """How this Blender's Cycles renders it, and other shaders."""
    return "v2_of_5" if bpy.app.version >= (5, 0, 0) else node_version()


def subsurface_method(node: bpy.types.Node) -> str:
    """RANDOM_WALK or RANDOM_WALK_SKIN of a Principled BSDF (in 3.x subsurface is not modelled)."""
    known = not is_version_3() and node.subsurface_method == "RANDOM_WALK_SKIN"
    return "RANDOM_WALK_SKIN" if known else "RANDOM_WALK"


def cycles_has_booleans() -> bool:
    """Whether Cycles takes booleans for whole numbers; Blender 3 passes over links from them."""
    return not is_version_3()


def has_textures_of_4_3() -> bool:
    """Noise and Voronoi textures as all versions from 4.3 on compute them."""
    return bpy.app.version >= (4, 3, 0)


def has_cells_of_5() -> bool:
    """Points in the cells of a Voronoi Texture where 5.0 places them."""
    return bpy.app.version >= (5, 0, 0)


def bump_width(node: bpy.types.Node) -> float | None:
    """Over how many pixels a Bump takes its differences; None if something varies it."""
    socket: bpy.types.NodeSocket | None = node.inputs.get("Filter Width")
    if socket is None:
        return 0.1 if bpy.app.version >= (4, 4, 0) else 1.0
    return None if socket.is_linked else float(socket.default_value)


def displacement_method(material: bpy.types.Material) -> str:
    """BUMP, DISPLACEMENT or BOTH."""
    if hasattr(material, "displacement_method"):  # 4.1 on
        return str(material.displacement_method)
    return str(material.cycles.displacement_method)


def bump_map_correction(material: bpy.types.Material) -> bool:
    """Whether bent normals keep reflections above the surface; Blender 3 always does."""
    return bool(getattr(material.cycles, "use_bump_map_correction", True))


def light_units() -> str:
    """Which convention the numbers of a lamp follow."""
    return "v3" if is_version_3() else "v4"


def soft_falloff(light: bpy.types.Light) -> bool:
    """Point and spot lamps: a disc facing the lit point (the only way in 3.x), or a sphere."""
    return bool(getattr(light, "use_soft_falloff", True))


def light_scale(light: bpy.types.Light) -> float:
    """2 to the lamp's exposure; 1 where there is no such setting."""
    return 2.0 ** float(getattr(light, "exposure", 0.0))


def light_is_normalized(light: bpy.types.Light) -> bool:
    """Whether the lamp's power is spread over its area (always, before 4.5)."""
    return bool(getattr(light, "normalize", True))


def temperature_color(light: bpy.types.Light) -> tuple[float, float, float] | None:
    """Colour of the lamp's temperature if it uses one."""
    if not getattr(light, "use_temperature", False):
        return None
    color = light.temperature_color
    return float(color[0]), float(color[1]), float(color[2])


def casts_shadow(light: bpy.types.Light) -> bool:
    """Whether Cycles lets the lamp cast shadows."""
    cycles = getattr(light, "cycles", None)
    if cycles is not None and hasattr(cycles, "cast_shadow"):
        return bool(cycles.cast_shadow)
    return bool(getattr(light, "use_shadow", True))


def transparent_shadows(material: bpy.types.Material) -> bool:
    """Whether shadow rays of Cycles see what is transparent of a material."""
    if hasattr(material, "use_transparent_shadow"):  # 4.2 on
        return bool(material.use_transparent_shadow)
    return bool(material.cycles.use_transparent_shadow)


def is_linear(image: bpy.types.Image) -> bool:
    """Whether `image.pixels` of a float image or of data are linear Rec. 709 numbers."""
    return image.colorspace_settings.name in _LINEAR_NAMES


def is_srgb(image: bpy.types.Image) -> bool:
    """Whether the image is marked as sRGB."""
    return image.colorspace_settings.name in _SRGB_NAMES


def is_data(image: bpy.types.Image) -> bool:
    """Whether the image holds numbers other than colours (Non-Color)."""
    return bool(image.colorspace_settings.is_data)


def set_linear(image: bpy.types.Image) -> None:
    """Its pixels are numbers that nothing decodes."""
    cast(BpyStruct, image.colorspace_settings).name = "Non-Color"


def add_group_output(tree: bpy.types.NodeTree, name: str, kind: str) -> None:
    """A new output of a node group; kind: of its socket."""
    if hasattr(tree, "interface"):  # 4.0 on
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
    else:
        cast(BpyStruct, tree).outputs.new(kind, name)


def is_editable(block: bpy.types.ID) -> bool:
    """False for what is linked from a library; writing there is lost on reload."""
    return block.library is None and bool(getattr(block, "is_editable", True))


def group_uses(tree: bpy.types.NodeTree) -> int:
    """How many nodes of the file are this group. (`tree.users` also counts a fake user, and the
    pointers that panels and add-ons keep.)"""
    owners = (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights)
    trees = [*bpy.data.node_groups, *(item.node_tree for item in owners if item.node_tree)]
    return sum(getattr(node, "node_tree", None) == tree for other in trees for node in other.nodes)


def whole_numbers(items: BpyStruct, name: str, each: int = 1) -> np.ndarray:  # any bpy list
    """(len(items) * each,) int32: a whole number, or an array of `each`, of every item.

    Of what it declares unsigned, Blender copies its memory into unsigned numbers; for signed ones
    it makes a Python object of each, which takes ten times as long.
    """
    if not len(items):
        return np.empty(0, np.int32)
    unsigned = items[0].bl_rna.properties[name].subtype == "UNSIGNED"
    found = np.empty(len(items) * each, np.uint32 if unsigned else np.int32)
    items.foreach_get(name, found)
    return found.view(np.int32)


def floats(items: BpyStruct, name: str, each: int) -> np.ndarray:  # any bpy list
    """(len(items), each) float32."""
    found = np.empty((len(items), each), np.float32)
    items.foreach_get(name, found.reshape(-1))
    return found


def corner_vertices(mesh: bpy.types.Mesh) -> np.ndarray:
    """(corners,) int32: the vertex of each corner of a face."""
    attribute: BpyStruct = mesh.attributes.get(".corner_vert")
    if attribute is not None:  # from 3.6 on, and much faster
        return whole_numbers(attribute.data, "value")
    return whole_numbers(mesh.loops, "vertex_index")


def triangle_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """(m,) int32: the face of each of `mesh.loop_triangles`, which must be calculated."""
    if hasattr(mesh, "loop_triangle_polygons"):  # from 4.1 on, and much faster
        return whole_numbers(mesh.loop_triangle_polygons, "value")
    return whole_numbers(mesh.loop_triangles, "polygon_index")


def normals_domain(mesh: bpy.types.Mesh) -> str:
    """What normals Cycles shades a mesh by: "CORNER", where faces are split; else "POINT" or
    "FACE", which differ in what faces are that nothing is said of."""
    if not hasattr(mesh, "normals_domain"):  # 3.x: only then are there sharp edges and own normals
        return "CORNER" if getattr(mesh, "use_auto_smooth", False) else "POINT"
    found = str(mesh.normals_domain)
    if found != "CORNER" or mesh.has_custom_normals or "custom_normal" in mesh.attributes:
        return found
    # Blender counts flat faces among what splits; Cycles does not.
    return "CORNER" if flags(mesh, "sharp_edge").any() else "POINT"


def flat_faces(mesh: bpy.types.Mesh, *, all_are: bool) -> np.ndarray:
    """(faces,) bool. all_are: what they are if the mesh says nothing of its faces."""
    if not hasattr(mesh, "normals_domain"):
        smooth = np.empty(len(mesh.polygons), bool)
        mesh.polygons.foreach_get("use_smooth", smooth)
        return ~smooth
    found = flags(mesh, "sharp_face")
    return found if len(found) else np.full(len(mesh.polygons), all_are)


def flags(mesh: bpy.types.Mesh, name: str) -> np.ndarray:
    """A boolean attribute, empty where there is none."""
    attribute: BpyStruct = mesh.attributes.get(name)
    if attribute is None or attribute.data_type != "BOOLEAN":
        return np.empty(0, bool)
    found = np.empty(len(attribute.data), bool)
    attribute.data.foreach_get("value", found)
    return found


def has_free_normals(mesh: bpy.types.Mesh) -> bool:
    """Whether custom normals are vectors of any length and direction (from 4.5 on), not relative to
    those of the surface."""
    attribute: BpyStruct = mesh.attributes.get("custom_normal")
    return attribute is not None and attribute.data_type == "FLOAT_VECTOR"


def splits_faces() -> bool:
    """Whether Cycles splits meshes at sharp edges, and has one normal for all corners of a vertex
    that is left (4.1 to 5.0; what 3.x splits is not known here)."""
    return (4, 1, 0) <= bpy.app.version < (5, 1, 0)


def shows_groups() -> bool:
    """Whether Cycles takes vertex groups for attributes."""
    return bpy.app.version >= (4, 1, 0)


def corner_normals(mesh: BpyStruct, corners: np.ndarray) -> np.ndarray:
    """(len(corners), 3) float32 normals of the corners of a mesh whose faces are split."""
    if hasattr(mesh, "corner_normals"):  # from 4.1 on
        return np.take(floats(mesh.corner_normals, "vector", 3), corners, axis=0)
    mesh.calc_normals_split()
    return np.take(floats(mesh.loops, "normal", 3), corners, axis=0)


def corner_uv_maps(mesh: bpy.types.Mesh, corners: np.ndarray) -> tuple[tuple[str, np.ndarray], ...]:
    """Name and (len(corners), 2) float32 of every UV map, the one that renders first."""
    found = []
    for layer in sorted(mesh.uv_layers, key=lambda item: not item.active_render):
        if hasattr(layer, "uv") and len(layer.uv):  # from 3.5 on, and much faster
            uvs = floats(layer.uv, "vector", 2)
        else:
            uvs = floats(layer.data, "uv", 2)
        found.append((layer.name, np.take(uvs, corners, axis=0)))
    return tuple(found)


def stored_colors(
    mesh: bpy.types.Mesh, corners: np.ndarray, vertices: np.ndarray
) -> tuple[tuple[str, np.ndarray, np.ndarray], ...]:
    """Name, (n, 3) float32 linear, and (len(corners),) int32 which of them each corner shows, of
    every colour attribute, the render one first.

    `corners`: loops, `vertices`: vertices of the triangles' corners.
    """
    found: list[tuple[str, np.ndarray, np.ndarray]] = []
    at_corners, at_vertices = corners.astype(np.int32), vertices.astype(np.int32)
    for index, attribute in enumerate(cast(BpyStruct, mesh.color_attributes)):
        colors = floats(attribute.data, "color", 4)[:, :3]  # bytes come decoded
        where = at_corners if attribute.domain == "CORNER" else at_vertices
        entry = (attribute.name, np.ascontiguousarray(colors), where)
        if index == mesh.color_attributes.render_color_index:
            found.insert(0, entry)
        else:
            found.append(entry)
    return tuple(found)


def color_attribute(mesh: bpy.types.Mesh, name: str) -> BpyStruct | None:
    """The colour attribute of a name, "" for the one that renders; None if there is none."""
    attributes = cast(BpyStruct, mesh.color_attributes)
    if name:
        return attributes.get(name)
    index = attributes.render_color_index
    return attributes[index] if 0 <= index < len(attributes) else None


def animated_paths(block: bpy.types.ID) -> Iterator[tuple[str, str]]:
    """("driven" | "keyframed", data path) of everything that animates `block`."""
    data = block.animation_data
    if data is None:
        return
    for driver in data.drivers:
        yield "driven", driver.data_path
    actions = [data.action]
    actions += [strip.action for track in data.nla_tracks for strip in track.strips]
    for action in actions:
        for curve in _curves(action) if action is not None else ():
            yield "keyframed", curve.data_path


def _curves(action: bpy.types.Action) -> Iterator[bpy.types.FCurve]:
    if hasattr(action, "fcurves"):
        yield from action.fcurves
        return
    for layer in action.layers:  # 5.0 on
        for strip in layer.strips:
            for bag in strip.channelbags:
                yield from bag.fcurves


def shadow_terminator(item: bpy.types.Object) -> BpyStruct:
    """Who holds `shadow_terminator_geometry_offset` as Cycles reads it: in 4.5 the object itself
    (the same name in `item.cycles` is left over there and has no effect), in 3.4 `item.cycles`."""
    return item if hasattr(item, "shadow_terminator_geometry_offset") else item.cycles
