// SPDX-License-Identifier: GPL-3.0-or-later
// Shadow rays through smoke so dense that ratio tracking ends most of them by roulette.
#include <gtest/gtest.h>

#include <cmath>

#include "render/media_scenes.h"
#include "render/picture_statistics.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr double kExtinction = 3.5, kThin = 0.4, kThick = 1.0;

/// A floor that the sun reaches through a slab of thin and thick smoke, or without it.
Scene floor_under(bool slab) {
  SceneBuilder builder;
  place(builder, quad_mesh(5), builder.add_material(matte("Floor", 0.8)),
        matrix({1, 0, 0}, {0, 0, 1}, {0, -1, 0}, {0, 3, 0}));
  Material smoke = matte("Smoke", 0);
  smoke.values.alpha = 0;
  smoke.values.extinction = Color<double>(kExtinction);
  smoke.values.albedo = Color<double>(0);
  smoke.density_grid.grid = std::make_shared<Grid>(
      "grid", std::array<int, 3>{1, 2, 1}, 1,
      std::vector<float>{static_cast<float>(kThin), static_cast<float>(kThick)});
  smoke.density_grid.to_unit = matrix({0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}, {0.5, 0.5, 0.5});
  const int material = builder.add_material(smoke);
  if (slab) place(builder, box_mesh(20, 1, 20), material);
  Light sun;
  sun.name = "Sun";
  sun.kind = LightKind::kSun;
  sun.values.power = 3;
  sun.to_world = looking_at({0, -5, 0}, {0, 0, 0});
  builder.add_light(sun);
  add_view(builder, {0, 2, 0}, {0, 3, 0});
  return builder.build();
}

// Less than a hundredth of the light passes, most of it in paths that the roulette has spared: without
// their weight three quarters of it would be missing.
TEST(DimShadowRays, RouletteKeepsTheirMean) {
  const Film clear = render_view(floor_under(false), settings_of(4, 400, 1, 1));
  const Film film = render_view(floor_under(true), settings_of(8, 4000, 1, 1));
  ASSERT_TRUE(complete(film));
  const double through = std::exp(-kExtinction * (kThin + kThick));
  ASSERT_LT(through, 0.01);
  for (int c = 0; c < 3; ++c) {
    const double want = mean_of(clear, c).mean * through;
    const Estimate light = mean_of(film, c);
    // One false alarm in 5000 runs with other seeds.
    EXPECT_LT(std::abs(light.mean - want), 4 * light.error + 1e-3 * want) << c;
    EXPECT_LT(light.error, 0.05 * want) << "else the above says little";
  }
}

}  // namespace
}  // namespace selenite
