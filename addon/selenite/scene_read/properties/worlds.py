# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds, and what Cycles adds to them."""

from __future__ import annotations

from . import conditions as when
from .rows import modelled, no_effect, refused, refused_by_reader, table, warned

WORLD = table(
    "World",
    modelled("color node_tree use_nodes animation_data cycles cycles_visibility"),
    # Ambient occlusion belongs to Fast GI, mist to a pass, the sun and the probe to EEVEE.
    no_effect("""
        light_settings mist_settings lightgroup use_eevee_finite_volume probe_resolution
        sun_threshold sun_angle use_sun_shadow sun_shadow_maximum_resolution
        sun_shadow_filter_radius use_sun_shadow_jitter sun_shadow_jitter_overblur
    """),
)


VISIBILITY = table(
    "CyclesVisibilitySettings",
    modelled("camera diffuse glossy transmission scatter"),
    no_effect("shadow"),
)

CYCLES_WORLD = table(
    "CyclesWorldSettings",
    modelled("max_bounces"),
    refused(
        "use_shadows",
        True,
        "its light passes through objects (Shadows is off), which is not modelled",
        "switch on World > Settings > Shadows",
    ),
    warned(
        "sampling_method",
        "AUTOMATIC",
        "Cycles samples it by the method {value}, which changes refraction by rough glass",
        "set World > Settings > Sampling to Auto",
        acts=when.with_transmission,
        covers="sample_map_resolution",
    ),
    warned(
        "is_caustics_light",
        False,
        "it makes shadow caustics, which are not modelled",
        "switch off World > Settings > Shadow Caustics",
        acts=when.with_caustics,
    ),
    # A world that is filled with a volume is refused.
    refused_by_reader("homogeneous_volume volume_sampling volume_interpolation volume_step_size"),
)

TABLES = (WORLD, VISIBILITY, CYCLES_WORLD)
