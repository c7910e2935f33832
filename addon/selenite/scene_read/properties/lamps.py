# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps: what all have, what each type has, and what Cycles adds."""

from __future__ import annotations

from . import conditions as when
from .rows import modelled, modelled_values, no_effect, table, warned, warned_by_reader

LIGHT = table(
    "Light",
    modelled("""
        color node_tree use_nodes animation_data cycles use_temperature temperature
        temperature_color exposure normalize use_shadow
    """),
    modelled_values("type", "POINT SUN SPOT AREA"),
    # EEVEE alone scales what a lamp does to diffuse, specular and volume.
    no_effect("""
        distance specular_factor diffuse_factor volume_factor transmission_factor
        use_custom_distance cutoff_distance
    """),
)

_SHADOW_MAPS = """
    shadow_buffer_size shadow_buffer_clip_start shadow_buffer_bias shadow_buffer_samples
    shadow_color use_contact_shadow contact_shadow_distance contact_shadow_bias
    contact_shadow_thickness shadow_filter_radius shadow_maximum_resolution use_shadow_jitter
    shadow_jitter_overblur
"""
_FALLOFF = """
    falloff_type falloff_curve linear_attenuation quadratic_attenuation constant_coefficient
    linear_coefficient quadratic_coefficient
"""

POINT = table(
    "PointLight",
    modelled("energy shadow_soft_size use_soft_falloff"),
    no_effect("use_shadow use_absolute_resolution" + _SHADOW_MAPS + _FALLOFF),
)
SPOT = table(
    "SpotLight",
    modelled("energy shadow_soft_size use_soft_falloff spot_size spot_blend"),
    no_effect("use_shadow use_absolute_resolution use_square show_cone" + _SHADOW_MAPS + _FALLOFF),
)
SUN = table(
    "SunLight",
    modelled("energy angle"),
    no_effect(
        """
        use_shadow shadow_soft_size shadow_cascade_max_distance shadow_cascade_count
        shadow_cascade_exponent shadow_cascade_fade
        """
        + _SHADOW_MAPS
    ),
)
AREA = table(
    "AreaLight",
    modelled("energy size size_y spread"),
    modelled_values("shape", "SQUARE RECTANGLE DISK ELLIPSE"),
    no_effect("use_shadow use_absolute_resolution shadow_soft_size" + _SHADOW_MAPS + _FALLOFF),
)

CYCLES_LIGHT = table(
    "CyclesLightSettings",
    modelled("cast_shadow max_bounces use_multiple_importance_sampling"),
    warned(
        "is_caustics_light",
        False,
        "it makes shadow caustics, which are not modelled",
        "switch off Shadow Caustics of the lamp",
        acts=when.with_caustics,
    ),
    warned_by_reader("is_portal"),
)

TABLES = (LIGHT, POINT, SPOT, SUN, AREA, CYCLES_LIGHT)
