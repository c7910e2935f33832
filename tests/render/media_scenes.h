// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/small_scenes.h"

// Bodies of one material that is filled, under a sky.
namespace selenite {

/// A boundary that is not seen: only its medium is.
inline Material fog(const Color<double>& extinction, double albedo, double g = 0) {
  Material m = matte("Medium", 0);
  m.values.alpha = 0;
  m.values.extinction = extinction;
  m.values.albedo = Color<double>(albedo);
  m.values.anisotropy = g;
  return m;
}
inline Material filled_glass(double roughness, double ior, double extinction, double albedo,
                             double g = 0) {
  Material m = glass("Medium", ior, roughness);
  m.values.extinction = Color<double>(extinction);
  m.values.albedo = Color<double>(albedo);
  m.values.anisotropy = g;
  return m;
}

/// One body of half-size `size` at the origin, seen along +y from four half-sizes away.
inline Scene body_scene(const Mesh& mesh, const Material& material, double size, double lens_mm) {
  SceneBuilder builder;
  place(builder, mesh, builder.add_material(material));
  add_view(builder, {0, -4 * size, 0}, {0, 0, 0}, lens_mm);
  builder.cameras.back().clip_start = 1e-3 * size;
  builder.cameras.back().clip_end = 1e3 * size;
  set_sky(builder, 1);
  return builder.build();
}
/// A box of thickness 2 in front of the camera.
inline Scene slab(const Material& material, double size = 1) {
  return body_scene(box_mesh(20 * size, size, 20 * size), material, size, 500);
}
/// The middle of a cube's face: half of all space, if the medium is dense.
inline Scene half_space(const Material& material, double size = 1) {
  return body_scene(box_mesh(size, size, size), material, size, 500);
}
inline Scene ball(const Material& material, double size = 1) {
  return body_scene(sphere_mesh(size, 16), material, size, 90);
}

/// A ball over a ground, under a lamp and a sky.
inline Scene lit_ball(const Material& material) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 12), builder.add_material(material));
  place(builder, quad_mesh(4), builder.add_material(matte("Ground", 0.3)),
        translation({0, 0, -1.1}));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = 2;
  lamp.values.power = 80;
  lamp.to_world = looking_at({2, 1, 3}, {0, 0, 0});
  builder.add_light(lamp);
  add_view(builder, {0, -4, 1}, {0, 0, 0}, 70);
  set_sky(builder, 0.5);
  return builder.build();
}

}  // namespace selenite
