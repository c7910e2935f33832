# SPDX-License-Identifier: GPL-3.0-or-later
"""An object that is baked: its mesh, a UV map without overlaps, and the bake itself."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, cast

import bpy
import numpy as np

from ...messages import thing
from ...problems import BadInput, Problem
from .. import hosts

if TYPE_CHECKING:
    from ..hosts import BpyStruct

UV_NAME = "selenite_bake"
#: Pixels along a side of the picture that shows whether a UV map is good.
_PROBE = 512
#: Share of the area that may be misplaced.
_MISPLACED = 0.002
#: Radians between faces of one island, and the distance of islands.
_ANGLE, _ISLANDS = 1.15, 0.004


class Stage:
    """An object in a scene that is baked. The file is changed."""

    def __init__(
        self,
        scene: bpy.types.Scene,
        item: bpy.types.Object,
        mesh: bpy.types.Mesh,
        slots: list[bool],
        *,
        alone: bool,
    ) -> None:
        """slots: those that are baked. mesh: evaluated. alone: no other object counts."""
        self._item = item
        self._slots = slots
        self.scene = bpy.data.scenes.new("Selenite bakes") if alone else scene
        self.scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
        if item.name not in self.scene.collection.objects:
            self.scene.collection.objects.link(item)
        item.modifiers.clear()
        item.data = mesh
        item.hide_render = item.hide_viewport = False
        while len(mesh.materials) < len(slots):
            mesh.materials.append(None)
        for slot in item.material_slots:
            slot.link = "DATA"
        render: BpyStruct = self.scene.render
        render.engine = "CYCLES"
        cycles: BpyStruct = self.scene.cycles
        cycles.device = "CPU"
        for name in ("use_denoising", "use_adaptive_sampling"):
            setattr(cycles, name, False)
        self.layer = self.scene.view_layers[0]
        self.layer.update()
        item.hide_set(False, view_layer=self.layer)
        for other in self.layer.objects:
            other.select_set(other == item, view_layer=self.layer)
        self.layer.objects.active = item
        self._blank = bpy.data.materials.new("Selenite blank")
        self._blank.use_nodes = True
        self._picture(self._blank, 16)

    def unwrap(self, column: int, row: int, tiles: int, border: float) -> None:
        """Adds a UV map without overlaps inside a tile."""
        mesh: BpyStruct = self._item.data
        own = next((layer for layer in mesh.uv_layers if layer.active_render), None)
        uv = _uv_of(own) if own is not None else np.zeros((len(mesh.loops), 2), np.float32)
        layer = mesh.uv_layers.new(name=UV_NAME, do_init=False)
        if layer is None:
            cause = "it has as many UV maps as Blender permits, so that none can be added to bake"
            raise BadInput(Problem(thing("Mesh", mesh.name), cause, "remove a UV map"))
        mesh.uv_layers.active = layer
        inside = own is not None and uv.min(initial=0) >= -1e-5 and uv.max(initial=1) <= 1 + 1e-5
        _set_uv(mesh.uv_layers[UV_NAME], uv)
        if not inside or self._misplaced(uv) > _MISPLACED:
            with self._context():
                bpy.ops.object.mode_set(mode="EDIT")
            with self._context(edit_object=self._item):
                bpy.ops.mesh.reveal()
                bpy.ops.mesh.select_all(action="SELECT")
                bpy.ops.uv.smart_project(angle_limit=_ANGLE, island_margin=_ISLANDS)
                bpy.ops.object.mode_set(mode="OBJECT")
            uv = _uv_of(mesh.uv_layers[UV_NAME])
        if tiles > 1:
            place = np.array([column, row], np.float32)
            uv = (place + uv) / tiles
            low, high = place / tiles + border, (place + 1) / tiles - border
            middle = (low + high) / 2
            uv = middle + (uv - (place + 0.5) / tiles) * (high - low) * tiles
        self._uv = uv.astype(np.float32)
        _set_uv(mesh.uv_layers[UV_NAME], self._uv)

    def _misplaced(self, uv: np.ndarray) -> float:
        """Share of the area whose centres of triangles lie elsewhere in a baked picture of
        positions: where the map overlaps, or a face has no area in it."""
        mesh: BpyStruct = self._item.data
        self._uv = uv
        material = bpy.data.materials.new("Selenite positions")
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        nodes = [
            tree.nodes.new(f"ShaderNode{x}") for x in ("TexCoord", "Emission", "OutputMaterial")
        ]
        tree.links.new(nodes[0].outputs["Object"], nodes[1].inputs["Color"])
        tree.links.new(nodes[1].outputs[0], nodes[2].inputs["Surface"])
        empty = np.float32(-1e30)
        found = self.bake(material, _PROBE, 1, 2, empty)
        bpy.data.materials.remove(material)
        mesh.calc_loop_triangles()
        loops = hosts.whole_numbers(mesh.loop_triangles, "loops", 3).reshape(-1, 3)
        vertices = hosts.corner_vertices(mesh)[loops]
        of_slot = np.array([*self._slots, False])[
            np.minimum(
                hosts.whole_numbers(mesh.polygons, "material_index")[hosts.triangle_faces(mesh)],
                len(self._slots),
            )
        ]
        corners = hosts.floats(mesh.vertices, "co", 3)[vertices]
        corners, places = corners[of_slot].astype(np.float64), uv[loops][of_slot].astype(np.float64)
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        d1, d2 = places[:, 1] - places[:, 0], places[:, 2] - places[:, 0]
        area = np.linalg.norm(np.cross(e1, e2), axis=1) / 2
        flat = np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
        length = np.maximum(np.linalg.norm(e1, axis=1), np.linalg.norm(e2, axis=1))
        across = np.maximum(np.linalg.norm(d1, axis=1), np.linalg.norm(d2, axis=1))
        # Per pixel the position moves by no more than that: a triangle's longest side over its
        # height in the map.
        with np.errstate(divide="ignore", invalid="ignore"):
            moves = np.where(flat > 0, length * across / flat, 0) / _PROBE
        middle = places.mean(axis=1)
        at = np.clip((middle * _PROBE).astype(int), 0, _PROBE - 1)
        seen = found[at[:, 1], at[:, 0]]
        distance = np.linalg.norm(seen - corners.mean(axis=1), axis=1)
        wrong = (distance > 3 * moves + 1e-4 * length) | (flat == 0)
        return float(area[wrong].sum() / max(area.sum(), 1e-30))

    def bake(
        self,
        material: bpy.types.Material,
        size: int,
        samples: int,
        margin: int,
        empty: np.float32,
        shift: float = 0.0,
    ) -> np.ndarray:
        """(size, size, 3) float32, row 0 at the bottom, of what `material` emits; `empty` where
        nothing is baked. shift: of the UV map."""
        mesh: BpyStruct = self._item.data
        _set_uv(mesh.uv_layers[UV_NAME], self._uv + np.float32(shift))
        image = self._picture(material, size)
        pixels = np.full(size * size * 4, empty, np.float32)
        cast("BpyStruct", image.pixels).foreach_set(pixels)
        for slot, counts in enumerate(self._slots):
            mesh.materials[slot] = material if counts else self._blank
        for slot in range(len(self._slots), len(mesh.materials)):
            mesh.materials[slot] = self._blank
        self.scene.cycles.samples = samples
        with self._context():
            bpy.ops.object.bake(
                type="EMIT",
                target="IMAGE_TEXTURES",
                save_mode="INTERNAL",
                use_clear=False,
                use_selected_to_active=False,
                margin=margin,
                margin_type="ADJACENT_FACES",
                uv_layer=UV_NAME,
            )
        cast("BpyStruct", image.pixels).foreach_get(pixels)
        bpy.data.images.remove(image)
        _set_uv(mesh.uv_layers[UV_NAME], self._uv)
        return np.ascontiguousarray(pixels.reshape(size, size, 4)[..., :3])

    def _picture(self, material: bpy.types.Material, size: int) -> bpy.types.Image:
        """A new image, which is the one that the material is baked into."""
        image = bpy.data.images.new("Selenite", size, size, alpha=True, float_buffer=True)
        hosts.set_linear(image)
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        for other in tree.nodes:
            other.select = other == node
        tree.nodes.active = node
        return image

    def _context(self, **more: object) -> AbstractContextManager[object]:
        item = self._item
        return bpy.context.temp_override(
            scene=self.scene,
            view_layer=self.layer,
            object=item,
            active_object=item,
            selected_objects=[item],
            selected_editable_objects=[item],
            **more,
        )


def _uv_of(layer: bpy.types.MeshUVLoopLayer) -> np.ndarray:
    if hasattr(layer, "uv") and len(layer.uv):
        return hosts.floats(layer.uv, "vector", 2)
    return hosts.floats(layer.data, "uv", 2)


def _set_uv(layer: bpy.types.MeshUVLoopLayer, values: np.ndarray) -> None:
    flat = np.ascontiguousarray(values, np.float32).reshape(-1)
    if hasattr(layer, "uv") and len(layer.uv):
        layer.uv.foreach_set("vector", flat)
    else:
        layer.data.foreach_set("uv", flat)
