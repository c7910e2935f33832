# SPDX-License-Identifier: GPL-3.0-or-later
"""The nodes that are read: what each has besides its inputs. Any other node is refused by name."""

from __future__ import annotations

from . import conditions as when
from .rows import (
    OneOf,
    modelled,
    modelled_values,
    no_effect,
    refused_by_reader,
    table,
    warned,
    warned_by_reader,
)

NODE = table(
    "Node",
    modelled("inputs outputs mute internal_links bl_idname"),
    no_effect("""
        type location location_absolute width width_hidden height dimensions name label parent
        use_custom_color color select show_options show_preview hide show_texture bl_label
        bl_description bl_icon bl_static_type bl_width_default bl_width_min bl_width_max
        bl_height_default bl_height_min bl_height_max warning_propagation color_tag panel_states
    """),
)
NODE_TREE = table(
    "NodeTree",
    modelled("nodes links inputs outputs interface animation_data"),
    no_effect("""
        view_center grease_pencil annotation type active_input active_output bl_idname bl_label
        bl_description bl_icon color_tag default_group_node_width description
        bl_use_group_interface
    """),
)

PRINCIPLED = table(
    "ShaderNodeBsdfPrincipled",
    warned(
        "distribution",
        "GGX",
        "the distribution {value} of {part} is rendered as GGX",
        "set it to GGX so that Cycles shows the same",
        acts=when.has_other_distribution,
    ),
    warned(
        "subsurface_method",
        OneOf(("RANDOM_WALK", "RANDOM_WALK_SKIN")),
        "the subsurface method {value} of {part} is rendered as Random Walk",
        "set it to Random Walk so that Cycles shows the same",
        acts=when.scatters_below_surface,
    ),
)

_OUTPUT = modelled("is_active_output target")  # of several the one for Cycles is read
_NEVER = no_effect("color_mapping image_user")

TABLES = (
    NODE,
    NODE_TREE,
    PRINCIPLED,
    *(
        table(f"ShaderNode{name}")
        for name in [
            "AddShader",
            "Background",
            "Emission",
            "NewGeometry",
            "RGB",
            "Value",
            "VolumeAbsorption",
            "VolumePrincipled",
        ]
    ),
    table("NodeInternal"),
    table("ShaderNode"),
    table("ShaderNodeTree"),
    table("ShaderNodeOutputMaterial", _OUTPUT),
    table("ShaderNodeOutputWorld", _OUTPUT),
    table("ShaderNodeOutputLight", _OUTPUT),
    # The Smart interpolation is Cubic without OSL.
    table(
        "ShaderNodeTexImage",
        modelled("image texture_mapping"),
        modelled_values("interpolation", "Linear Closest Cubic Smart"),
        modelled_values("extension", "REPEAT EXTEND CLIP MIRROR"),
        _NEVER,
        refused_by_reader("projection", covers="projection_blend"),
    ),
    table(
        "ShaderNodeTexEnvironment",
        modelled("image texture_mapping"),
        _NEVER,
        refused_by_reader("projection"),
        warned_by_reader("interpolation"),
    ),
    table("ShaderNodeVertexColor", modelled("layer_name")),
    table("ShaderNodeAttribute", modelled("attribute_name"), refused_by_reader("attribute_type")),
    table("ShaderNodeMapping", refused_by_reader("vector_type")),
    table("ShaderNodeTexCoord", refused_by_reader("object from_instancer")),
    table("ShaderNodeUVMap", modelled("uv_map"), refused_by_reader("from_instancer")),
    table("ShaderNodeVolumeScatter", refused_by_reader("phase")),
    table("ShaderNodeVolumeCoefficients", refused_by_reader("phase")),
    table("ShaderNodeGroup", modelled("node_tree interface")),
    table("NodeGroupInput", modelled("interface")),
    table("NodeGroupOutput", modelled("interface is_active_output")),
    table("NodeReroute", no_effect("socket_idname")),
)
