# SPDX-License-Identifier: GPL-3.0-or-later
"""View layers, their collections, and collections."""

from __future__ import annotations

from . import conditions as when
from .rows import modelled, no_effect, noise_only, refused, table, warned

VIEW_LAYER = table(
    "ViewLayer",
    modelled("layer_collection objects depsgraph cycles material_override world_override use_sky"),
    refused(
        "use_solid",
        True,
        "Surfaces are filtered out of its render, which is not modelled",
        "switch on Filter > Surfaces of the view layer",
    ),
    refused(
        "use_volumes",
        True,
        "Volumes are filtered out of its render, which is not modelled",
        "switch on Filter > Volumes of the view layer",
        acts=when.with_media,
    ),
    warned(
        "use",
        True,
        "it is read, though no view layer is used for rendering",
        "switch on Use for Rendering of the view layer",
    ),
    noise_only("samples"),
    no_effect("""
        name pass_alpha_threshold eevee aovs active_aov active_aov_index lightgroups
        active_lightgroup active_lightgroup_index active_layer_collection use_ao use_strand
        use_motion_blur use_freestyle freestyle_settings use_grease_pencil has_export_collections
        use_pass_combined use_pass_z use_pass_vector use_pass_position use_pass_normal use_pass_uv
        use_pass_mist use_pass_object_index use_pass_material_index use_pass_shadow
        use_pass_ambient_occlusion use_pass_emit use_pass_environment use_pass_diffuse_direct
        use_pass_diffuse_indirect use_pass_diffuse_color use_pass_glossy_direct
        use_pass_glossy_indirect use_pass_glossy_color use_pass_transmission_direct
        use_pass_transmission_indirect use_pass_transmission_color use_pass_subsurface_direct
        use_pass_subsurface_indirect use_pass_subsurface_color use_pass_cryptomatte_object
        use_pass_cryptomatte_material use_pass_cryptomatte_asset pass_cryptomatte_depth
        use_pass_cryptomatte_accurate use_pass_grease_pencil
    """),
)

CYCLES_LAYER = table(
    "CyclesRenderLayerSettings",
    no_effect("""
        pass_debug_sample_count use_pass_volume_direct use_pass_volume_indirect
        use_pass_shadow_catcher use_denoising denoising_store_passes denoising_store_motion_passes
        denoising_pass_follow_reflections denoising_pass_use_albedo_roughness_weighting
        pass_render_time use_pass_volume_scatter use_pass_volume_transmit use_pass_volume_majorant
    """),
)

LAYER_COLLECTION = table(
    "LayerCollection",
    modelled("collection children exclude hide_viewport holdout indirect_only"),
    no_effect("name is_visible"),
)

COLLECTION = table(
    "Collection",
    modelled("""
        instance_offset objects all_objects children collection_objects collection_children
        hide_render hide_viewport
    """),
    no_effect("""
        hide_select lineart_usage lineart_use_intersection_mask lineart_intersection_mask
        lineart_intersection_priority use_lineart_intersection_priority color_tag importer
        exporters active_exporter_index
    """),
)

TABLES = (VIEW_LAYER, CYCLES_LAYER, LAYER_COLLECTION, COLLECTION)
