# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes, curves, texts, metaballs and volumes: the data of objects."""

from __future__ import annotations

from .rows import modelled, modelled_values, no_effect, refused_by_reader, table, warned

_TEXSPACE = """
    use_auto_texspace texspace_location texspace_size
"""

# Texture spaces and other meshes give coordinates that materials with textures may not use here.
MESH = table(
    "Mesh",
    modelled("""
        vertices edges loops polygons vertex_normals polygon_normals corner_normals normals_domain
        loop_triangles loop_triangle_polygons uv_layers vertex_colors attributes color_attributes
        use_auto_smooth auto_smooth_angle has_custom_normals shape_keys materials animation_data
        cycles
    """),
    no_effect(
        """
        auto_texspace texture_mesh texco_mesh uv_layer_clone uv_layer_clone_index uv_layer_stencil
        uv_layer_stencil_index sculpt_vertex_colors vertex_layers_float vertex_layers_int
        vertex_layers_string polygon_layers_float polygon_layers_int polygon_layers_string
        face_maps skin_vertices vertex_creases edge_creases vertex_paint_masks radial_symmetry
        remesh_voxel_size remesh_voxel_adaptivity use_remesh_fix_poles use_remesh_preserve_volume
        use_remesh_preserve_paint_mask use_remesh_preserve_sculpt_face_sets
        use_remesh_preserve_vertex_colors use_remesh_preserve_attributes remesh_mode use_mirror_x
        use_mirror_y use_mirror_z use_mirror_vertex_groups use_mirror_topology
        has_bevel_weight_edge has_bevel_weight_vertex has_crease_edge has_crease_vertex
        use_paint_mask use_paint_mask_vertex use_paint_bone_selection total_vert_sel total_edge_sel
        total_face_sel is_editmode
        """
        + _TEXSPACE
    ),
)

# Blender makes a mesh of them.
CURVE = table(
    "Curve",
    modelled("""
        shape_keys splines path_duration use_path use_path_follow use_path_clamp use_stretch
        use_deform_bounds use_radius bevel_mode bevel_profile bevel_resolution offset extrude
        bevel_depth resolution_u resolution_v render_resolution_u render_resolution_v eval_time
        bevel_object taper_object dimensions
        fill_mode fill_solver fill_rule twist_mode taper_radius_mode bevel_factor_mapping_start
        bevel_factor_mapping_end twist_smooth use_fill_caps use_map_taper materials
        bevel_factor_start bevel_factor_end animation_data cycles
    """),
    no_effect("is_editmode" + _TEXSPACE),
)
TEXT = table(
    "TextCurve",
    modelled("""
        align_x align_y overflow size small_caps_scale space_line space_word space_character shear
        offset_x offset_y underline_position underline_height text_boxes family body body_format
        follow_curve font font_bold font_italic font_bold_italic
    """),
    no_effect("""
        active_textbox edit_format use_fast_edit is_select_bold is_select_italic
        is_select_underline is_select_smallcaps has_selection
    """),
)
SURFACE = table("SurfaceCurve")
METABALL = table(
    "MetaBall",
    modelled("elements resolution render_resolution threshold materials animation_data cycles"),
    no_effect("is_editmode update_method" + _TEXSPACE),
)
CYCLES_MESH = table("CyclesMeshSettings")

VOLUME = table(
    "Volume",
    modelled("""
        filepath is_sequence frame_start frame_duration frame_offset sequence_mode grids materials
        render animation_data
    """),
    refused_by_reader("packed_file"),
    # For motion blur, which is named.
    no_effect("velocity_grid velocity_unit velocity_scale"),
    no_effect("velocity_x_grid velocity_y_grid velocity_z_grid"),
    no_effect("display"),
)
VOLUME_RENDER = table(
    "VolumeRender",
    modelled_values("space", "OBJECT WORLD"),
    warned(
        "step_size",
        0.0,
        "Cycles takes steps of {value} through its grids, which changes how dense they are",
        "set Render > Step Size of the volume to 0",
    ),
    no_effect("precision clipping"),
)

TABLES = (MESH, CURVE, TEXT, SURFACE, METABALL, CYCLES_MESH, VOLUME, VOLUME_RENDER)
