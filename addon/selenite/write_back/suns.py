# SPDX-License-Identifier: GPL-3.0-or-later
"""Bright spots of the world's image -> Sun lamps, and an image without them."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Vector

from ..environments import bright_spots, sphere
from ..environments.bright_spots import Sun
from ..problems import BadInput, Problem
from ..scene_read.values import SceneValues
from . import environments

#: Of lamps and their objects, before a number.
NAME = "Environment Sun"


def proposed(values: SceneValues, most: int) -> tuple[list[Sun], np.ndarray]:
    """Up to `most` suns of the world's image, at its strength and in the frame of the world, and
    the image without them. Raises BadInput where there is no image, or no spot in it."""
    world = values.world
    title, cure = "World", "fit World:environment, or give it a panorama of the room"
    if world.image is None:
        raise BadInput(Problem(title, "it has no image, whose spots could be lamps", cure))
    if not world.strength > 0:
        cause = f"its strength is {world.strength:g}, which makes it black"
        raise BadInput(Problem(title, cause, "set its Strength to 1"))
    directions = sphere.directions(*world.image.shape[:2]) @ world.to_map.T
    image = world.image
    if not np.allclose(world.to_map, np.eye(3), rtol=0, atol=1e-6):
        image = sphere.looked_up(image, directions)
    found, rest = bright_spots.suns(image, most)
    if not found:
        cause = "no spot of its image is three times as bright as the mean over all directions"
        raise BadInput(Problem(title, cause, "keep the image as it is"))
    scaled = [
        Sun(
            item.direction,
            tuple(world.strength * value for value in item.irradiance),  # type: ignore[arg-type]
            item.angle,
        )
        for item in found
    ]
    return scaled, rest


def add(scene: bpy.types.Scene, values: SceneValues, suns: list[Sun], rest: np.ndarray) -> str:
    """Adds the lamps and links the image without them. Returns what was done. Raises BadInput, and
    then nothing has changed. The caller makes it one undo step."""
    done = environments.show_pixels(scene, values, rest)
    for item in suns:
        light = bpy.data.lights.new(NAME, "SUN")
        light.energy = max(item.irradiance)
        light.color = [value / light.energy for value in item.irradiance]
        light.angle = item.angle
        lamp = bpy.data.objects.new(NAME, light)
        lamp.rotation_mode = "QUATERNION"
        lamp.rotation_quaternion = Vector(item.direction).to_track_quat("Z", "Y")
        lamp.location = [3 * value for value in item.direction]  # only for the eye
        scene.collection.objects.link(lamp)
    return f"{len(suns)} suns; {done}"


def text(item: Sun) -> str:
    """A line about a sun."""
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, item.direction[2]))))
    azimuth = math.degrees(math.atan2(item.direction[1], item.direction[0]))
    colour = ", ".join(f"{value:.3g}" for value in item.irradiance)
    return (
        f"sun {elevation:.0f} degrees above the horizon, {azimuth:.0f} from +X towards +Y: "
        f"irradiance {colour} W/m2, {math.degrees(item.angle):.1f} degrees wide"
    )
