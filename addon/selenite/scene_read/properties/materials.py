# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials, and what Cycles adds to them."""

from __future__ import annotations

from . import conditions as when
from .rows import modelled, no_effect, noise_only, refused_by_reader, table, warned

MATERIAL = table(
    "Material",
    modelled("node_tree use_nodes diffuse_color animation_data cycles use_transparent_shadow"),
    # A linked Displacement is refused, whatever is done with it.
    refused_by_reader("displacement_method", covers="max_vertex_displacement"),
    no_effect("""
        blend_method shadow_method alpha_threshold show_transparent_back use_backface_culling
        use_backface_culling_shadow use_backface_culling_lightprobe_volume use_screen_refraction
        use_raytrace_refraction use_sss_translucency refraction_depth preview_render_type
        use_preview_world pass_index texture_paint_images texture_paint_slots paint_active_slot
        paint_clone_slot specular_color roughness specular_intensity metallic line_color
        line_priority grease_pencil is_grease_pencil lineart surface_render_method
        use_transparency_overlap thickness_mode use_thickness_from_shadow
        volume_intersection_method
    """),
)

CYCLES_MATERIAL = table(
    "CyclesMaterialSettings",
    modelled("use_transparent_shadow"),
    warned(
        "homogeneous_volume",
        False,
        "Cycles takes its medium as homogeneous, in a Volume object too",
        "switch off Settings > Volume > Homogeneous of the material",
        acts=when.with_volume_objects,
    ),
    warned(
        "volume_interpolation",
        "LINEAR",
        "Cycles interpolates its grids by the method {value}; here they are interpolated linearly",
        "set Settings > Volume > Interpolation of the material to Linear",
        acts=when.with_volume_objects,
    ),
    warned(
        "volume_step_rate",
        1.0,
        "Cycles takes longer steps through its grids (Step Rate {value})",
        "set Settings > Volume > Step Rate of the material to 1, or below",
        acts=lambda cycles, scope: scope.has_volume_objects and cycles.volume_step_rate > 1,
    ),
    refused_by_reader("displacement_method"),
    # It keeps the mirror direction of smooth coarse meshes above their faces, without bump too.
    warned(
        "use_bump_map_correction",
        True,
        "Bump Map Correction is off, with which Cycles bends the normals of reflections otherwise",
        "switch on Settings > Surface > Bump Map Correction of the material",
    ),
    noise_only("sample_as_light emission_sampling volume_sampling"),
)

TABLES = (MATERIAL, CYCLES_MATERIAL)
