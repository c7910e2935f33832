// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/small_scenes.h"

// A plane, the lamps that light it, and a sheet that hides it.
namespace selenite {

inline Light sun(double strength, const Vec3d& from = {0.6, 0, 0.8}) {
  Light light;
  light.name = "Sun";
  light.kind = LightKind::kSun;
  light.values.power = strength;
  light.to_world = looking_at(from, {0, 0, 0});
  return light;
}
inline Light area(double power, double side, const Vec3d& from) {
  Light light;
  light.name = "Key";
  light.kind = LightKind::kArea;
  light.size_x = light.size_y = side;
  light.values.power = power;
  light.to_world = looking_at(from, {0, 0, 0});
  return light;
}

/// A plane z = 0 seen from above in a narrow view of its origin; object 0.
inline SceneBuilder plane(const Material& material) {
  SceneBuilder builder;
  place(builder, quad_mesh(5), builder.add_material(material));
  add_view(builder, {0, -3, 3}, {0, 0, 0}, 1e5);
  return builder;
}
/// A wide black sheet over the origin, under the camera; returns the object.
inline Instance& sheet(SceneBuilder& builder, double height = 1) {
  const int material = builder.add_material(matte("Sheet", 0));
  return builder.instances[place(builder, quad_mesh(1e4), material, translation({0, 0, height}))];
}

}  // namespace selenite
