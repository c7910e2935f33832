# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects, what Cycles adds to them, light linking, and modifiers as a kind."""

from __future__ import annotations

from . import conditions as when
from .rows import (
    OneOf,
    modelled,
    modelled_values,
    no_effect,
    refused,
    refused_by_reader,
    remarked,
    table,
    warned,
)

OBJECT = table(
    "Object",
    modelled("""
        data parent parent_type parent_vertices parent_bone parent_bone_head_tail_factor
        use_parent_final_indices track_axis up_axis material_slots location rotation_quaternion
        rotation_axis_angle rotation_euler rotation_mode scale delta_location delta_rotation_euler
        delta_rotation_quaternion delta_scale matrix_world matrix_local matrix_basis
        matrix_parent_inverse dimensions modifiers constraints vertex_groups face_maps
        add_rest_position_attribute field collision soft_body rigid_body rigid_body_constraint
        use_simulation_cache show_only_shape_key use_shape_key_edit_mode active_shape_key
        active_shape_key_index hide_render show_instancer_for_render instance_type
        use_instance_vertices_rotation use_instance_faces_scale instance_faces_scale
        instance_collection animation_data cycles visible_camera visible_diffuse visible_glossy
        visible_transmission visible_volume_scatter visible_shadow is_holdout light_linking
        hide_viewport
    """),
    modelled_values(
        "type",
        """
        MESH CURVE SURFACE META FONT CURVES POINTCLOUD VOLUME GPENCIL GREASEPENCIL ARMATURE LATTICE
        EMPTY LIGHT LIGHT_PROBE CAMERA SPEAKER
        """,
    ),
    refused(
        "is_shadow_catcher",
        False,
        "it is a shadow catcher, which is not modelled",
        "switch off Object > Visibility > Shadow Catcher",
        acts=when.casts_into_picture,  # a new lamp says that it is one
    ),
    remarked("shadow_terminator_geometry_offset"),
    warned(
        "shadow_terminator_shading_offset",
        0.0,
        "its Shadow Terminator > Shading Offset is {value}, which is not modelled",
        "set it to 0 (Object > Shading)",
        acts=when.casts_into_picture,
    ),
    refused_by_reader("particle_systems"),  # those that render as hair
    no_effect("""
        mode bound_box use_camera_lock_parent active_material active_material_index lock_location
        lock_rotation lock_rotation_w lock_rotations_4d lock_scale grease_pencil_modifiers
        shader_effects empty_display_type empty_display_size empty_image_offset image_user
        empty_image_depth show_empty_image_perspective show_empty_image_orthographic
        show_empty_image_only_axis_aligned use_empty_image_alpha empty_image_side pass_index color
        hide_select show_instancer_for_viewport is_instancer display_type display_bounds_type
        display show_bounds show_name show_axis show_texture_space show_wire show_all_edges
        use_grease_pencil_lights show_transparent show_in_front pose pose_library
        use_dynamic_topology_sculpting is_from_instancer is_from_set lineart use_mesh_mirror_x
        use_mesh_mirror_y use_mesh_mirror_z lightgroup animation_visualization motion_path
        hide_probe_volume hide_probe_sphere hide_probe_plane shadow_terminator_normal_offset
        hide_surface_pick visible_raycast
    """),
)

LIGHT_LINKING = table("ObjectLightLinking", modelled("receiver_collection blocker_collection"))

CYCLES_OBJECT = table(
    "CyclesObjectSettings",
    refused(
        "use_adaptive_subdivision",
        False,
        "Adaptive Subdivision subdivides it as finely as the camera sees it, which is not modelled",
        "switch it off in the Subdivision Surface modifier, and use fixed levels",
        acts=lambda item, scope: scope.scene.cycles.feature_set == "EXPERIMENTAL",
        covers="dicing_rate",
    ),
    warned(
        "use_camera_cull",
        False,
        "Cycles leaves it out where the camera does not see it (Simplify > Culling)",
        "switch off Camera Cull of the object, or Simplify",
        acts=when.is_culled_by_camera,
    ),
    warned(
        "use_distance_cull",
        False,
        "Cycles leaves it out far from the camera (Simplify > Culling)",
        "switch off Distance Cull of the object, or Simplify",
        acts=when.is_culled_by_distance,
    ),
    # In 3.4 the offsets are here; later versions keep the names without an effect.
    remarked("shadow_terminator_geometry_offset"),
    warned(
        "shadow_terminator_offset",
        0.0,
        "its Shadow Terminator > Shading Offset is {value}, which is not modelled",
        "set it to 0 (Object > Shading)",
        acts=lambda cycles, _: not hasattr(cycles.id_data, "shadow_terminator_shading_offset"),
    ),
    # A lamp that makes them is named.
    no_effect("is_caustics_caster is_caustics_receiver"),
    # With motion blur and Fast GI, which are named.
    no_effect("use_motion_blur use_deform_motion motion_steps ao_distance"),
)

MODIFIER = table(
    "Modifier",
    modelled("use_apply_on_spline use_pin_to_last show_render show_viewport"),
    refused(
        "type",
        OneOf(()),
        "modifier '{part}' is a domain of smoke or fire, whose grids are not read",
        "export it as OpenVDB and use a Volume object, or hide it from renders",
        acts=when.is_fire,
    ),
    no_effect("""
        name show_in_editmode show_on_cage show_expanded is_active is_override_data execution_time
        persistent_uid
    """),
)

# The one modifier that has something which only Cycles evaluates.
SUBDIVISION = table(
    "SubsurfModifier",
    modelled("""
        uv_smooth quality boundary_smooth subdivision_type levels render_levels use_creases
        use_custom_normals use_limit_surface
    """),
    refused(
        "use_adaptive_subdivision",
        False,
        "modifier '{part}' subdivides it as finely as the camera sees it (Adaptive Subdivision), "
        "which is not modelled",
        "switch off Adaptive Subdivision, and use fixed levels",
        covers="adaptive_space adaptive_pixel_size adaptive_object_edge_length",
    ),
    no_effect("show_only_control_edges open_adaptive_subdivision_panel open_advanced_panel"),
)

TABLES = (OBJECT, LIGHT_LINKING, CYCLES_OBJECT, MODIFIER, SUBDIVISION)
