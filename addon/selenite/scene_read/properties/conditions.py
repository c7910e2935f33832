# SPDX-License-Identifier: GPL-3.0-or-later
"""When a property can change a picture: what else the scene has to hold for that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import bpy

from .. import hosts

Block = hosts.BpyStruct

# Nodes of a compositor that hand the picture on as it is
_PASS_ON = {
    "CompositorNodeRLayers",
    "CompositorNodeComposite",
    "CompositorNodeViewer",
    "CompositorNodeSplitViewer",
    "CompositorNodeOutputFile",
    "NodeReroute",
    "NodeFrame",
    "NodeGroupInput",
    "NodeGroupOutput",
}

#: Bits of a pixel of one or three channels.
_WITHOUT_ALPHA = {8, 24, 48, 96}


@dataclass(frozen=True)
class Scope:
    """What takes part in a render: original datablocks, each once.

    objects: all that render, lamps among them. instancers: objects that are only the parents of
    what is rendered.
    """

    scene: bpy.types.Scene
    view_layer: bpy.types.ViewLayer
    objects: tuple[bpy.types.Object, ...] = ()
    instancers: tuple[bpy.types.Object, ...] = ()
    cameras: tuple[bpy.types.Object, ...] = ()
    materials: tuple[bpy.types.Material, ...] = ()
    world: bpy.types.World | None = None
    has_grids: bool = False  # of volumes, which modifiers make too

    @cached_property
    def has_volume_objects(self) -> bool:
        """Whether media vary in space."""
        return self.has_grids or any(item.type == "VOLUME" for item in self.objects)

    @cached_property
    def has_transmission(self) -> bool:
        """Whether light is refracted by a material."""
        names = ("Transmission Weight", "Transmission")
        return any(uses(node, names) for material in self.materials for node in _nodes(material))

    @cached_property
    def has_media(self) -> bool:
        """Whether anything scatters light in a volume."""
        return self.has_volume_objects or any(
            link.to_socket.name == "Volume" for item in self.materials for link in _links(item)
        )

    @cached_property
    def has_alpha_of_opaque_files(self) -> bool:
        """Whether a material uses the alpha of an image file that has none."""
        nodes = (node for item in self.materials for node in _nodes(item))
        images = (node for node in nodes if isinstance(node, bpy.types.ShaderNodeTexImage))
        return any(
            node.image is not None
            and node.image.source == "FILE"
            and node.image.packed_file is None
            and node.image.depth in _WITHOUT_ALPHA
            and node.outputs["Alpha"].is_linked
            for node in images
        )

    @cached_property
    def has_caustics(self) -> bool:
        """Whether objects cast and others receive shadow caustics."""
        flags = [item.cycles for item in self.objects]
        return any(item.is_caustics_caster for item in flags) and any(
            item.is_caustics_receiver for item in flags
        )


def uses(node: bpy.types.Node, names: tuple[str, ...], neutral: float = 0.0) -> bool:
    """Whether an input of a Principled BSDF is linked or differs from its neutral value."""
    if node.bl_idname != "ShaderNodeBsdfPrincipled":
        return False
    sockets: list[Block] = [node.inputs[name] for name in names if name in node.inputs]
    return any(socket.is_linked or socket.default_value != neutral for socket in sockets)


def _nodes(material: bpy.types.Material) -> Iterator[bpy.types.Node]:
    """All nodes of a material, those inside of groups too."""
    pending = [material.node_tree] if material.use_nodes and material.node_tree else []
    seen = set()
    while pending:
        tree = pending.pop()
        if tree.name_full in seen:
            continue
        seen.add(tree.name_full)
        for node in tree.nodes:
            yield node
            inner = getattr(node, "node_tree", None)
            if inner is not None:
                pending.append(inner)


def _links(material: bpy.types.Material) -> Iterator[Block]:
    if material.use_nodes and material.node_tree is not None:
        yield from material.node_tree.links


def compositor_acts(scene: Block, _: Scope) -> bool:
    """Whether the compositor changes the picture after Cycles."""
    tree = (
        scene.compositing_node_group
        if hasattr(scene, "compositing_node_group")  # since 5.0
        else scene.node_tree
        if scene.use_nodes
        else None
    )
    return bool(
        scene.render.use_compositing
        and tree is not None
        and any(node.bl_idname not in _PASS_ON and not node.mute for node in tree.nodes)
    )


def sequencer_acts(scene: Block, _: Scope) -> bool:
    """Whether strips are shown in place of the render."""
    editor = scene.sequence_editor
    strips = getattr(editor, "strips", None) or getattr(editor, "sequences", ())
    return bool(scene.render.use_sequencer and len(strips))


def other_layers_render(scene: Block, scope: Scope) -> bool:
    """Whether further view layers take part in the picture."""
    others = (item for item in scene.view_layers if item.name != scope.view_layer.name)
    return not scene.render.use_single_layer and any(item.use for item in others)


def layer_draws_lines(_: Block, scope: Scope) -> bool:
    """Whether Freestyle draws onto the view layer."""
    return bool(scope.view_layer.use_freestyle)


def is_simplified(_: Block, scope: Scope) -> bool:
    """Whether Simplify is on, without which its settings do nothing."""
    return bool(scope.scene.render.use_simplify)


def is_culled_by_camera(_: Block, scope: Scope) -> bool:
    """Whether Cycles leaves out what the camera does not see."""
    return bool(scope.scene.render.use_simplify and scope.scene.cycles.use_camera_cull)


def is_culled_by_distance(_: Block, scope: Scope) -> bool:
    """Whether Cycles leaves out what is far away."""
    return bool(scope.scene.render.use_simplify and scope.scene.cycles.use_distance_cull)


def with_volume_objects(_: Block, scope: Scope) -> bool:
    """Media that vary in space are the only ones that Cycles takes steps through."""
    return scope.has_volume_objects


def with_media(_: Block, scope: Scope) -> bool:
    """Rays that were scattered in a medium exist only with a medium."""
    return scope.has_media


def with_transmission(_: Block, scope: Scope) -> bool:
    """Rays that were refracted exist only with a material that refracts."""
    return scope.has_transmission


def with_alpha_of_opaque_files(_: Block, scope: Scope) -> bool:
    """Where Open Shading Language shows something else than the other shading system. Without it in
    the build, Cycles takes that one."""
    return bpy.app.build_options.cycles_osl and scope.has_alpha_of_opaque_files


def with_caustics(_: Block, scope: Scope) -> bool:
    """A light has shadow caustics only with objects that cast and receive them."""
    return scope.has_caustics


def scatters_below_surface(node: Block, _: Scope) -> bool:
    """Whether a Principled BSDF has subsurface scattering."""
    return uses(node, ("Subsurface Weight", "Subsurface"))


def casts_into_picture(item: Block, _: Scope) -> bool:
    """Whether an object has faces, whose shadows can be moved."""
    return item.type != "LIGHT"


def is_fire(modifier: Block, _: Scope) -> bool:
    """Whether a Fluid modifier makes a domain of smoke, a medium with grids."""
    domain = getattr(modifier, "domain_settings", None)
    return domain is not None and domain.domain_type == "GAS"


def has_other_distribution(node: Block, _: Scope) -> bool:
    """Blender 3 renders Multiscatter GGX by a random walk; later versions as it is modelled."""
    return bool(node.distribution != "MULTI_GGX" or hosts.is_version_3())
