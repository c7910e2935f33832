# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneValues -> native Scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from .. import native
from .baking.wanted import UV_NAME
from .texture_values import TextureValues
from .values import LightValues, MapValues, MaterialValues, MeshValues, SceneValues, greyed

if TYPE_CHECKING:
    from .._core import Scene, SceneBuilder


def build(values: SceneValues) -> Scene:
    """Builds the native scene (ray tracing structure included; the GIL is released meanwhile).

    Raises ValueError for a value out of range and NativeUnavailable.
    """
    builder = native.core().SceneBuilder()
    describe(values, builder)
    return builder.build()


def describe(values: SceneValues, builder: SceneBuilder) -> None:
    """Calls the builder with all that it needs. Raises as `build`."""
    textures: dict[TextureValues, int] = {}
    materials = {
        item.name: builder.add_material(
            item.name,
            {name: value[0] if len(value) == 1 else value for name, value in item.values.items()},
            multi_ggx=item.multi_ggx,
            flavour=item.flavour,
            subsurface=item.subsurface,
            physical_refraction=values.physical_refraction,
            transparent_shadows=item.transparent_shadows,
            maps={name: _native_map(builder, textures, found) for name, found in item.maps.items()},
            grids={use: vars(grid) for use, grid in item.grids.items()},
            shader=_native_shader(builder, textures, item, values),
        )
        for item in values.materials
    }
    maps = [found for item in values.materials for found in item.maps.values()]
    uv_maps = {found.attribute for found in maps if found.texture is not None}
    colors = {(found.attribute, found.grey) for found in maps if found.texture is None}
    for shader in (item.shader for item in values.materials):
        if shader is not None:
            uv_maps |= shader.attributes("uv")
            colors |= {(name, "") for name in shader.attributes("color")}
    meshes = [
        builder.add_mesh(
            mesh.name,
            mesh.positions,
            mesh.triangles,
            mesh.corner_normals,
            mesh.material_slots,
            uv_maps=_wanted(mesh.uv_maps, uv_maps),
            colors=_colors(mesh, colors),
            vectors=list(mesh.vectors),
            stored_colors=_stored_colors(mesh, colors),
        )
        for mesh in values.meshes
    ]
    for item in values.objects:
        builder.add_object(
            item.name,
            meshes[item.mesh],
            item.matrix,
            [materials[name] for name in item.materials],
            visible_to=item.visible_to,
            holdout=item.holdout,
            lit_set=item.lit_set,
            shadow_set=item.shadow_set,
            lit=item.lit,
            facts=vars(item.facts),
        )
    for light in values.lights:
        _add_light(builder, light)
    world = values.world
    c, s = np.cos(world.rotation), np.sin(world.rotation)
    before = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ world.to_map
    sun = world.sun.arguments if world.sun is not None else None
    builder.set_world(world.color, world.strength, world.image, before, world.rotation, sun)
    for seen in world.backdrops:
        disc = seen.sun.arguments if seen.sun is not None else None
        builder.add_backdrop(seen.kinds, seen.image, seen.to_map, seen.scaled, disc)
    builder.set_world_visibility(
        world.visible_to,
        max_bounces=world.max_bounces,
        transparent_film=world.transparent_film,
        film_roughness=world.film_roughness,
    )
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


def _native_map(
    builder: SceneBuilder,
    textures: dict[TextureValues, int],
    found: MapValues,
) -> dict[str, object]:
    """The native form of a map; adds its texture if it is the first that uses it."""
    texture = found.texture
    index = _native_texture(builder, textures, texture) if texture is not None else None
    attribute = found.attribute if texture is not None else found.called
    return {"texture": index, "attribute": attribute, "uv": found.uv}


def _native_texture(
    builder: SceneBuilder,
    textures: dict[TextureValues, int],
    texture: TextureValues,
) -> int:
    """The number of a texture, which is added if it is the first time that it is used."""
    if texture not in textures:
        textures[texture] = builder.add_texture(
            texture.name,
            texture.pixels,
            encoded=texture.encoded,
            extension=texture.extension,
            interpolation=texture.interpolation,
        )
    return textures[texture]


def _native_shader(
    builder: SceneBuilder,
    textures: dict[TextureValues, int],
    item: MaterialValues,
    values: SceneValues,
) -> dict[str, object] | None:
    """The native form of a material's shader; adds its textures."""
    if item.shader is None:
        return None
    used = [_native_texture(builder, textures, texture) for texture in item.shader.textures]
    return item.shader.native(used, physical_refraction=values.physical_refraction)


def _wanted(
    lists: tuple[tuple[str, np.ndarray], ...], names: set[str]
) -> list[tuple[str, np.ndarray]]:
    """Those that a material asks for; "" asks for the first, if it is the user's own."""
    return [
        item
        for index, item in enumerate(lists)
        if item[0] in names or (index == 0 and "" in names and not item[0].startswith(UV_NAME))
    ]


def _colors(mesh: MeshValues, wanted: set[tuple[str, str]]) -> list[tuple[str, np.ndarray]]:
    """Colour attributes that a material asks for, by name and what becomes of them on the way."""
    found = _wanted(mesh.colors, {name for name, grey in wanted if not grey})
    for name, grey in sorted(item for item in wanted if item[1]):
        for _, values in _wanted(mesh.colors, {name})[:1]:
            found.append((MapValues(None, name, grey=grey).called, greyed(values, grey)))
    return found


def _stored_colors(
    mesh: MeshValues, wanted: set[tuple[str, str]]
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """What a fit can change of the colour attributes that a material asks for as they are."""
    names = {name for name, _ in _wanted(mesh.colors, {name for name, grey in wanted if not grey})}
    return {
        name: (stored, elements) for name, stored, elements in mesh.stored_colors if name in names
    }


def _add_light(builder: SceneBuilder, light: LightValues) -> None:
    add: dict[str, Callable[..., int]] = {
        "POINT": builder.add_point_light,
        "SUN": builder.add_sun_light,
        "SPOT": builder.add_spot_light,
        "AREA": builder.add_area_light,
    }
    index = add[light.kind](
        light.name,
        light.matrix,
        light.power,
        light.color,
        **light.shape,
        light_units=light.light_units,
        radiance_scale=light.radiance_scale,
    )
    if light.object:
        builder.set_light_object(index, light.object)
    builder.set_light_visibility(
        index,
        light.visible_to,
        casts_shadows=light.casts_shadows,
        met_by_rays=light.met_by_rays,
        max_bounces=light.max_bounces,
        lit=light.lit,
        shading=light.shading,
    )
