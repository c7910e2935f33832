// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <utility>

#include "scene/small_scenes.h"

namespace selenite {

/// A box with a UV map on a ground, both of the material, before a lamp and under the sky: light is
/// scattered by its maps several times.
inline Scene box_on_ground(Material material,
                           std::optional<CornerData<Colorf>> colors = std::nullopt) {
  SceneBuilder builder;
  const int number = builder.add_material(std::move(material));
  Mesh box = box_mesh(0.6, 0.6, 0.6);
  std::vector<Vec2f> uv;
  for (const auto& triangle : box.triangles)
    for (const int corner : triangle) {
      const Vec3f p = box.positions[static_cast<std::size_t>(corner)];
      uv.push_back({0.5f + 0.4f * p.x + 0.1f * p.z, 0.5f + 0.3f * p.y + 0.4f * p.z});
    }
  box.uvs.push_back({"UVMap", std::move(uv)});
  if (colors) box.colors.push_back(std::move(*colors));
  place(builder, box, number, translation({0, 0, 0.6}));
  place(builder, quad_mesh(2), number);
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = 2;
  lamp.values.power = 80;
  lamp.to_world = looking_at({2, -1, 3}, {0, 0, 0});
  builder.add_light(lamp);
  add_view(builder, {1, -3.5, 2}, {0, 0, 0.4}, 50);
  set_sky(builder, 0.6);
  return builder.build();
}

}  // namespace selenite
