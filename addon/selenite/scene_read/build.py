# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneValues -> native Scene."""

from __future__ import annotations

from typing import Any

from .. import native
from .values import LightValues, SceneValues


def build(values: SceneValues) -> Any:  # noqa: ANN401 - a native Scene has no Python type
    """Builds the native scene (ray tracing structure included; the GIL is released meanwhile).

    Raises ValueError for a value out of range and NativeUnavailable.
    """
    builder = native.core().SceneBuilder()
    materials = {
        item.name: builder.add_material(
            item.name,
            {name: value[0] if len(value) == 1 else value for name, value in item.values.items()},
            multi_ggx=item.multi_ggx,
            flavour=item.flavour,
        )
        for item in values.materials
    }
    meshes = [
        builder.add_mesh(
            mesh.name,
            mesh.positions,
            mesh.triangles,
            mesh.corner_normals,
            mesh.material_slots,
            mesh.uvs,
        )
        for mesh in values.meshes
    ]
    for item in values.objects:
        builder.add_object(
            item.name,
            meshes[item.mesh],
            item.matrix,
            [materials[name] for name in item.materials],
            visible_to_camera=item.visible_to_camera,
        )
    for light in values.lights:
        _add_light(builder, light)
    world = values.world
    builder.set_world(world.color, world.strength, world.image, world.to_map)
    for camera in values.cameras:
        builder.add_camera(
            camera.name,
            camera.matrix,
            camera.kind,
            camera.lens_mm,
            camera.sensor_width,
            camera.sensor_height,
            camera.sensor_fit,
            camera.shift_x,
            camera.shift_y,
            camera.ortho_scale,
            camera.clip_start,
            camera.clip_end,
            camera.pixel_aspect_x,
            camera.pixel_aspect_y,
        )
    return builder.build()


def _add_light(builder: Any, light: LightValues) -> None:  # noqa: ANN401
    add = {
        "POINT": builder.add_point_light,
        "SUN": builder.add_sun_light,
        "SPOT": builder.add_spot_light,
        "AREA": builder.add_area_light,
    }[light.kind]
    add(
        light.name,
        light.matrix,
        light.power,
        light.color,
        **light.shape,
        light_units=light.light_units,
        radiance_scale=light.radiance_scale,
    )
