// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "fit/problem/fields.h"
#include "scene/small_scenes.h"

// Bodies whose base colour is an image of 2 x 2 texels.
namespace selenite {

inline constexpr int kTexels = 2;

inline int field_number(const char* name) {
  const auto& table = parameter_table(OwnerKind::kMaterial);
  int field = 0;
  while (table[field].name != name) ++field;
  return field;
}

/// A base colour of 2 x 2 texels, grey numbers `stored`, row 0 at the top.
inline FieldMap image_of(const std::vector<float>& stored, bool encoded, std::vector<float> alpha) {
  std::vector<Colorf> pixels;
  for (const float x : stored) pixels.emplace_back(x);
  FieldMap map;
  map.field = field_number("base_color");
  map.texture = std::make_shared<Texture>("Wood", kTexels, kTexels, pixels, std::move(alpha),
                                          encoded, Extension::kExtend, Interpolation::kLinear);
  return map;
}

/// A square lamp that shines at the origin.
inline Light lamp(double side, const Vec3d& from) {
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = side;
  lamp.values.power = 40;
  lamp.to_world = looking_at(from, {0, 0, 0});
  return lamp;
}

/// A board with that image.
inline Scene board(const std::vector<float>& stored, bool encoded = false,
                   std::vector<float> alpha = {}) {
  Material m = plastic("Board");
  m.values.roughness = 0.5;
  m.maps.push_back(image_of(stored, encoded, std::move(alpha)));
  SceneBuilder builder;
  place(builder, quad_mesh(1), builder.add_material(m));
  builder.add_light(lamp(0.5, {0.3, 1.5, 2}));  // whose gloss tells the roughness
  add_view(builder, {0.3, -1.5, 2}, {0, 0, 0});
  set_sky(builder, 0.4);
  return builder.build();
}

/// A sphere of clear glass with an image, before a lamp.
inline Scene glass_sphere(double ior, const std::vector<float>& stored) {
  Material m = plastic("Board");
  m.values.roughness = 0.02;
  m.values.transmission = 1;
  m.values.ior = ior;
  m.maps.push_back(image_of(stored, false, {}));
  Mesh sphere = sphere_mesh(0.7);
  std::vector<Vec2f> corners;
  for (const auto& triangle : sphere.triangles)
    for (const int vertex : triangle) {
      const Vec3f& at = sphere.positions[static_cast<std::size_t>(vertex)];
      corners.push_back({0.5f + 0.7f * at.x, 0.5f + 0.7f * at.z});
    }
  sphere.uvs.push_back({"UVMap", std::move(corners)});
  SceneBuilder builder;
  place(builder, std::move(sphere), builder.add_material(m));
  builder.add_light(lamp(1, {0.8, 2.5, 0.6}));
  add_view(builder, {0, -3, 0}, {0, 0, 0});
  set_sky(builder, 0.4);
  return builder.build();
}

/// The same with an even image of more texels than are stepped together with scalars.
inline Scene with_many_texels(Scene scene, float color) {
  constexpr int kMany = 257;
  FieldMap& map = scene.appearance.materials[0].maps[0];
  map.texture = std::make_shared<Texture>(
      "Wood", kMany, kMany, std::vector<Colorf>(kMany * kMany, Colorf(color)), std::vector<float>{},
      map.texture->encoded(), Extension::kExtend, Interpolation::kLinear);
  return scene;
}

inline UnknownParameter texels(double minimum = 0, double maximum = 1) {
  return {"Board", kBaseColorTexture, {}, minimum, maximum, 0.03};
}
inline UnknownParameter roughness() { return {"Board", "roughness", {0.8}, 0.05, 1, 0.03}; }

}  // namespace selenite
