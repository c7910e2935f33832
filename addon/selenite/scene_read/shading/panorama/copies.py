# SPDX-License-Identifier: GPL-3.0-or-later
"""A copy of a world that shows every ray what one kind of ray sees."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack

import bpy

from ..nodes import Source
from .rays import Rays, is_light_path


class WorldCopy:
    """Its node groups are copies too, each for one place. Removed with the stack."""

    def __init__(self, world: bpy.types.World, stack: ExitStack) -> None:
        self.world = world.copy()
        stack.callback(bpy.data.worlds.remove, self.world)
        self.world.cycles_visibility.camera = True
        self.world.cycles.sampling_method = "NONE"
        self._groups: list[bpy.types.NodeTree] = []
        stack.callback(self._remove_groups)
        self._copy_groups(self.world.node_tree)

    def show_as_to(self, rays: Rays) -> None:
        """Light Path nodes give what they give to these rays."""
        for tree in self._trees():
            for node in [item for item in tree.nodes if is_light_path(item)]:
                for output in node.outputs:
                    self._set(tree, output, float(output.identifier in rays.outputs))

    def set_strength(self, background: Source, strength: float) -> None:
        """Of the node that `background` is in the original."""
        assert background.node is not None  # noqa: S101 - a shader node
        tree = self.world.node_tree
        for group in background.groups:
            tree = tree.nodes[group.name].node_tree
        socket = tree.nodes[background.node.name].inputs["Strength"]
        for link in list(socket.links):
            tree.links.remove(link)
        socket.default_value = strength

    def set_discs(self, shown: bool) -> None:
        """Sun discs of the Sky Textures that have one."""
        self._each_sky(lambda node: setattr(node, "sun_disc", shown) if node.sun_disc else None)

    def _each_sky(self, action: Callable[[bpy.types.Node], None]) -> None:
        for tree in self._trees():
            for node in tree.nodes:
                if node.bl_idname == "ShaderNodeTexSky":
                    action(node)

    def _trees(self) -> list[bpy.types.NodeTree]:
        return [self.world.node_tree, *self._groups]

    def _copy_groups(self, tree: bpy.types.NodeTree) -> None:
        for node in tree.nodes:
            if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
                node.node_tree = node.node_tree.copy()
                self._groups.append(node.node_tree)
                self._copy_groups(node.node_tree)

    def _remove_groups(self) -> None:
        for tree in self._groups:
            bpy.data.node_groups.remove(tree)

    @staticmethod
    def _set(tree: bpy.types.NodeTree, output: bpy.types.NodeSocket, number: float) -> None:
        links = [(link.to_socket, link.is_muted) for link in output.links]
        ends = [socket for socket, is_muted in links if not is_muted]
        if ends:
            value = tree.nodes.new("ShaderNodeValue")
            value.outputs[0].default_value = number
            for end in ends:
                tree.links.new(value.outputs[0], end)
