// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/small_scenes.h"

// Bodies of one material "Medium" that is filled, under a sky of radiance 1.
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

}  // namespace selenite
