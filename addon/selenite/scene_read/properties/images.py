# SPDX-License-Identifier: GPL-3.0-or-later
"""Images, how nodes use them, and the mapping inside of texture nodes."""

from __future__ import annotations

from .rows import (
    OneOf,
    Row,
    modelled,
    no_effect,
    refused,
    refused_by_reader,
    table,
    warned,
    warned_by_reader,
)

IMAGE = table(
    "Image",
    modelled("""
        filepath filepath_raw packed_file packed_files generated_type generated_width
        generated_height use_generated_float generated_color size pixels channels is_float
        colorspace_settings has_data
    """),
    refused_by_reader("source type alpha_mode", covers="tiles frame_duration use_deinterlace"),
    warned_by_reader("is_dirty"),
    warned(
        "use_multiview",
        False,
        "it has several views; only the first is read",
        "switch off Use Multi-View of the image",
        covers="is_stereo_3d is_multiview views_format stereo_3d_format",
    ),
    no_effect("""
        file_format use_view_as_render display_aspect bindcode render_slots depth resolution
        use_half_precision seam_margin
    """),
)

# Frames and layers are for movies, sequences and layered files, which are refused.
IMAGE_USER = table(
    "ImageUser",
    no_effect("""
        use_auto_refresh frame_current use_cyclic frame_duration frame_offset frame_start
        multilayer_layer multilayer_pass multilayer_view tile
    """),
)

COLORSPACE = table(
    "ColorManagedInputColorspaceSettings",
    modelled("is_data interop_id"),
    refused_by_reader("name"),
)


def _mapping(name: str, neutral: object, covers: str = "") -> Row:
    return refused(
        name,
        neutral,
        "the Texture Mapping in the sidebar of {part} is not neutral ({label} is {value})",
        "reset it to {neutral} and use a Mapping node",
        covers=covers,
    )


TEXTURE_MAPPING = table(
    "TexMapping",
    _mapping(
        "vector_type", OneOf(("POINT", "TEXTURE", "VECTOR"))
    ),  # which leave alone what is neutral
    _mapping("translation", (0.0, 0.0, 0.0)),
    _mapping("rotation", (0.0, 0.0, 0.0)),
    _mapping("scale", (1.0, 1.0, 1.0)),
    _mapping("mapping_x", "X"),
    _mapping("mapping_y", "Y"),
    _mapping("mapping_z", "Z"),
    no_effect("use_min use_max min max mapping"),
)

# Cycles does not know them.
COLOR_MAPPING = table(
    "ColorMapping",
    no_effect("""
        use_color_ramp color_ramp brightness contrast saturation blend_type blend_color
        blend_factor
    """),
)

TABLES = (IMAGE, IMAGE_USER, COLORSPACE, TEXTURE_MAPPING, COLOR_MAPPING)
