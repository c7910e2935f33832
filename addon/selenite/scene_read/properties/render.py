# SPDX-License-Identifier: GPL-3.0-or-later
"""Scene, render settings and the settings of Cycles."""

from __future__ import annotations

from . import conditions as when
from .rows import OneOf, modelled, no_effect, noise_only, refused, remarked, table, warned

_STEPS = "the steps of Cycles through grids are longer, which darkens or brightens them"

SCENE = table(
    "Scene",
    modelled("""
        camera world objects collection render cycles unit_settings frame_current frame_subframe
        frame_float frame_current_final animation_data rigidbody_world gravity use_gravity
        background_set
        use_custom_simulation_range simulation_frame_start simulation_frame_end
    """),
    warned(
        "view_layers",
        None,
        "several view layers are rendered; only the first of them is read",
        "switch off Use for Rendering in the others",
        acts=when.other_layers_render,
    ),
    warned(
        "node_tree",
        None,
        "its compositor changes the picture after Cycles; the picture before it is what is fitted",
        "switch off Compositing (Output > Post Processing) to compare pictures",
        acts=when.compositor_acts,
    ),
    warned(
        "compositing_node_group",
        None,
        "its compositor changes the picture after Cycles; the picture before it is what is fitted",
        "switch off Compositing (Output > Post Processing) to compare pictures",
        acts=when.compositor_acts,
        covers="compositor_effects use_nodes",
    ),
    warned(
        "sequence_editor",
        None,
        "a render shows the strips of its sequencer in place of what the camera sees",
        "switch off Sequencer (Output > Post Processing)",
        acts=when.sequencer_acts,
    ),
    no_effect("""
        frame_start frame_end frame_step frame_preview_start frame_preview_end use_preview_range
        lock_frame_selection_to_range show_subframe show_keys_from_selected_only use_stamp_note
        is_nla_tweakmode sync_mode keying_sets keying_sets_all tool_settings safe_areas
        timeline_markers transform_orientation_slots cursor use_audio use_audio_scrub
        audio_doppler_speed audio_doppler_factor audio_distance_model audio_volume time_jump_unit
        time_jump_delta allow_preroll wrap_timeline_navigation playback_loop_mode annotation
        grease_pencil grease_pencil_settings active_clip display eevee hydra view_settings
        display_settings sequencer_colorspace_settings cycles_curves
    """),
)

RENDER = table(
    "RenderSettings",
    modelled("""
        resolution_x resolution_y resolution_percentage pixel_aspect_x pixel_aspect_y frame_map_old
        frame_map_new film_transparent use_simplify simplify_subdivision simplify_subdivision_render
        simplify_child_particles simplify_child_particles_render use_simplify_normals
         use_single_layer
    """),
    remarked("engine"),
    warned(
        "use_motion_blur",
        False,
        "motion blur is not modelled",
        "switch off Motion Blur in the render settings",
        covers="""
            motion_blur_shutter motion_blur_shutter_curve motion_blur_position
        """,
    ),
    warned(
        "use_border",
        False,
        "the render region is ignored; the whole picture is rendered",
        "switch off Output > Render Region, or render the whole picture",
        acts=lambda render, _: not render.use_crop_to_border,  # which is refused
        covers="border_min_x border_min_y border_max_x border_max_y",
    ),
    refused(
        "use_crop_to_border",
        False,
        "its pictures are cropped to the render region, which is not modelled",
        "switch off Crop to Render Region, and give photos of the whole frame",
        acts=lambda render, _: render.use_border,
    ),
    warned(
        "use_freestyle",
        False,
        "Freestyle draws lines over what Cycles renders; they are not modelled",
        "switch off Freestyle in the render settings",
        acts=when.layer_draws_lines,
        covers="line_thickness line_thickness_mode",
    ),
    warned(
        "use_stamp",
        False,
        "Metadata > Burn Into Image draws text over the picture",
        "switch it off",
        covers="""
            use_stamp_time use_stamp_date use_stamp_frame use_stamp_frame_range use_stamp_camera
            use_stamp_lens use_stamp_scene use_stamp_note use_stamp_marker use_stamp_filename
            use_stamp_sequencer_strip use_stamp_render_time stamp_note_text use_stamp_labels
            metadata_input use_stamp_memory use_stamp_hostname stamp_font_size stamp_foreground
            stamp_background
        """,
    ),
    warned(
        "use_multiview",
        False,
        "Stereoscopy renders every camera from several places; only its own is read",
        "switch off Output > Stereoscopy",
        covers="views stereo_views views_format use_spherical_stereo",
    ),
    refused(
        "simplify_volumes",
        1.0,
        "Simplify renders volumes at {value} of their resolution, which is not modelled",
        "set Volume Resolution of Simplify to 1",
        acts=lambda render, scope: render.use_simplify and scope.has_volume_objects,
    ),
    warned(
        "use_auto_generate_texture_cache",
        False,
        "Cycles may take smaller copies of textures (Texture Cache), which are read in full",
        "switch off Auto Generate of the Texture Cache",
        acts=lambda render, _: render.use_texture_cache,
    ),
    # Without copies of the textures on disk it does nothing.
    no_effect("use_texture_cache"),
    no_effect("""
        anisotropic_filter save_output use_compositor_frames_cache preview_pixel_size
        image_settings ffmpeg fps fps_base ppm_factor ppm_base dither_intensity filter_size threads
        threads_mode hair_type hair_subdiv use_high_quality_normals use_placeholder use_overwrite
        use_compositing use_sequencer use_file_extension file_extension is_movie_format
        use_lock_interface filepath use_render_cache bake bake_type use_bake_selected_to_active
        use_bake_clear bake_margin bake_margin_type bake_bias use_bake_multires use_bake_lores_mesh
        bake_samples use_bake_user_scale bake_user_scale sequencer_gl_preview
        use_sequencer_override_scene_strip has_multiple_engines
        use_persistent_data simplify_gpencil simplify_gpencil_onplay simplify_gpencil_antialiasing
        simplify_gpencil_view_fill simplify_gpencil_modifier simplify_gpencil_shader_fx
        simplify_gpencil_tint compositor_device compositor_precision compositor_denoise_device
        compositor_denoise_preview_quality compositor_denoise_final_quality use_new_cpu_compositor
    """),
)

CYCLES = table(
    "CyclesRenderSettings",
    # These end, clamp or filter paths: the fit sees full transport of light.
    remarked("max_bounces", 12, worse="<"),
    remarked("diffuse_bounces", 4, worse="<"),
    remarked("glossy_bounces", 4, worse="<"),
    remarked("transmission_bounces", 12, worse="<"),
    remarked("transparent_max_bounces", 8, worse="<"),
    remarked("volume_bounces"),  # 0 is the factory setting
    remarked("sample_clamp_direct", 0.0, worse=">"),
    remarked("sample_clamp_indirect", 10.0),
    remarked("blur_glossy", 1.0, worse=">"),
    remarked("caustics_reflective", True, worse="!="),
    remarked("caustics_refractive", True, worse="!="),
    remarked("use_fast_gi", False, "fast_gi_method ao_bounces ao_bounces_render", worse="!="),
    remarked("light_sampling_threshold"),
    remarked("pixel_filter_type", covers="filter_width"),
    remarked("film_exposure", 1.0, worse="!="),
    remarked(
        "use_denoising",
        covers="""
            denoiser denoising_prefilter denoising_input_passes denoising_quality denoising_use_gpu
        """,
    ),
    no_effect("direct_light_sampling_type"),  # for debug builds of Cycles
    warned(  # beside rounding: the means of equal seeds agree within 0.07 %
        "shading_system",
        False,
        "with Open Shading Language, Cycles takes an image file without alpha for transparent",
        "switch off Open Shading Language, pack the image, or unlink its Alpha",
        acts=when.with_alpha_of_opaque_files,
    ),
    warned(
        "texture_limit_render",
        "OFF",
        "Simplify limits textures to {value} pixels in a render; they are read in full",
        "set the Texture Limit for renders to No Limit (Simplify)",
        acts=when.is_simplified,
    ),
    warned(
        "texture_resolution_render",
        1.0,
        "Simplify scales textures by {value} in a render; they are read in full",
        "set the Texture Resolution for renders to 1 (Simplify)",
        acts=when.is_simplified,
    ),
    warned(
        "volume_biased",
        False,
        f"volumes are rendered Biased: {_STEPS}",
        "switch off Volumes > Biased",
        acts=when.with_volume_objects,
    ),
    # Cycles marches through grids in steps; these are coarser than the factory settings.
    warned(
        "volume_step_rate",
        OneOf((1.0,)),
        f"the volume Step Rate is {{value}}: {_STEPS}",
        "set it to 1, or below",
        acts=lambda cycles, scope: scope.has_volume_objects and cycles.volume_step_rate > 1,
    ),
    warned(
        "volume_max_steps",
        1024,
        f"the volume Max Steps are {{value}}: {_STEPS}",
        "set it to 1024",
        acts=lambda cycles, scope: scope.has_volume_objects and cycles.volume_max_steps < 1024,
    ),
    noise_only("""
        samples sample_offset use_sample_subset sample_subset_length time_limit sampling_pattern
        scrambling_distance auto_scrambling_distance use_layer_samples use_adaptive_sampling
        adaptive_threshold adaptive_min_samples min_light_bounces min_transparent_bounces
        use_light_tree seed use_animated_seed use_guiding use_deterministic_guiding
        guiding_distribution_type use_surface_guiding surface_guiding_probability
        use_volume_guiding guiding_training_samples volume_guiding_probability
        use_guiding_direct_light use_guiding_mis_weights guiding_directional_sampling_type
        guiding_roughness_threshold use_pixel_jitter device
    """),
    no_effect("""
        feature_set preview_pause preview_samples preview_scrambling_distance
        use_preview_adaptive_sampling preview_adaptive_threshold preview_adaptive_min_samples
        use_preview_denoising preview_denoiser preview_denoising_prefilter
        preview_denoising_input_passes preview_denoising_start_sample preview_denoising_quality
        preview_denoising_use_gpu volume_preview_step_rate preview_dicing_rate texture_limit
        bake_type preview_denoising_upscale_quality texture_resolution
        debug_use_texture_cache_eviction debug_texture_cache_preserve_unused debug_bvh_type
        debug_use_spatial_splits debug_use_hair_bvh debug_use_compact_bvh debug_bvh_time_steps
        debug_use_cpu_avx2 debug_use_cpu_avx debug_use_cpu_sse41 debug_use_cpu_sse42
        debug_use_cpu_sse3 debug_use_cpu_sse2 debug_bvh_layout debug_use_cuda_adaptive_compile
        debug_use_hip_adaptive_compile debug_use_metal_adaptive_compile debug_use_optix_debug
        use_auto_tile tile_size
    """),
    modelled("film_transparent_glass film_transparent_roughness"),
    # They act together with a switch elsewhere, which is named: adaptive subdivision and culling of
    # an object, motion blur.
    no_effect("dicing_rate max_subdivisions dicing_camera offscreen_dicing_scale"),
    no_effect("use_camera_cull camera_cull_margin use_distance_cull distance_cull_margin"),
    no_effect("motion_blur_position rolling_shutter_type rolling_shutter_duration"),
)

# A file of another unit scale renders the same; lengths in millimetres are reported with it.
UNITS = table(
    "UnitSettings",
    modelled("system scale_length"),
    no_effect("""
        system_rotation use_separate length_unit mass_unit time_unit temperature_unit
    """),
)

# They change what is shown on screen and written to 8 bits, after the radiance.
VIEW = table(
    "ColorManagedViewSettings",
    remarked("view_transform"),
    no_effect("""
        look exposure gamma curve_mapping use_curve_mapping use_white_balance
        white_balance_temperature white_balance_tint white_balance_whitepoint use_hdr_view is_hdr
        support_emulation
    """),
)
DISPLAY = table("ColorManagedDisplaySettings", no_effect("display_device emulation"))
SEQUENCER = table("ColorManagedSequencerColorspaceSettings", no_effect("name interop_id"))

TABLES = (SCENE, RENDER, CYCLES, UNITS, VIEW, DISPLAY, SEQUENCER)
