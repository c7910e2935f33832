// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "scene/small_scenes.h"

namespace selenite {

/// Smoke with 2 x 2 x 2 albedos under a grey sky and a lamp from one side.
inline Scene smoke(const std::vector<float>& albedo, int channels = 1) {
  Material m = matte("Smoke", 0);
  m.values.alpha = 0;
  m.values.extinction = Color<double>(2);
  m.albedo_grid = {std::make_shared<Grid>("albedo", std::array<int, 3>{2, 2, 2}, channels, albedo),
                   matrix({0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0.5, 0.5})};
  SceneBuilder builder;
  place(builder, box_mesh(1, 1, 1), builder.add_material(m));
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kArea;
  lamp.size_x = lamp.size_y = 2;
  lamp.values.power = 150;
  lamp.to_world = looking_at({3, -1, 2}, {0, 0, 0});
  builder.add_light(lamp);
  add_view(builder, {0, -5, 1}, {0, 0, 0}, 70);
  add_view(builder, {4, 3, 1}, {0, 0, 0}, 70);
  set_sky(builder, 0.3);
  return builder.build();
}

}  // namespace selenite
