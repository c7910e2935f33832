# SPDX-License-Identifier: GPL-3.0-or-later
"""Cameras, their depth of field, and what Cycles added to them before 4.x."""

from __future__ import annotations

from .rows import modelled, modelled_values, no_effect, refused_by_reader, table, warned

_PANORAMA = """
    panorama_type fisheye_fov fisheye_lens latitude_min latitude_max longitude_min longitude_max
    fisheye_polynomial_k0 fisheye_polynomial_k1 fisheye_polynomial_k2 fisheye_polynomial_k3
    fisheye_polynomial_k4
"""
_CYLINDER = """
    central_cylindrical_range_u_min central_cylindrical_range_u_max central_cylindrical_range_v_min
    central_cylindrical_range_v_max central_cylindrical_radius
"""
_CUSTOM = """
    custom_filepath custom_shader custom_mode custom_bytecode custom_bytecode_hash cycles_custom
"""

CAMERA = table(
    "Camera",
    modelled("""
        sensor_width sensor_height lens angle angle_x angle_y clip_start clip_end ortho_scale
        shift_x shift_y dof animation_data
    """),
    modelled_values("sensor_fit", "AUTO HORIZONTAL VERTICAL"),
    # Panoramas and cameras of a shader's own are left out, with the reason.
    refused_by_reader("type", covers="cycles" + _PANORAMA + _CYLINDER + _CUSTOM),
    no_effect("""
        stereo passepartout_alpha display_size show_limits show_mist show_passepartout
        show_safe_areas show_safe_center show_name show_sensor show_background_images lens_unit
        show_composition_center show_composition_center_diagonal show_composition_thirds
        show_composition_golden show_composition_golden_tria_a show_composition_golden_tria_b
        show_composition_harmony_tri_a show_composition_harmony_tri_b background_images
        composition_guide_color
    """),
)

DEPTH_OF_FIELD = table(
    "CameraDOFSettings",
    warned(
        "use_dof",
        False,
        "depth of field is not modelled",
        "switch off Depth of Field of the camera, if the photo is sharp",
        covers="""
            focus_object focus_subtarget focus_distance aperture_fstop aperture_blades
            aperture_rotation aperture_ratio
        """,
    ),
)

CYCLES_CAMERA = table("CyclesCameraSettings", refused_by_reader(_PANORAMA))

TABLES = (CAMERA, DEPTH_OF_FIELD, CYCLES_CAMERA)
