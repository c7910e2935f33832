// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/starts/rotation_start.h"

#include <gtest/gtest.h>

#include "fit/problem/saved_state.h"
#include "fit/run/fit.h"
#include "fit/taken_photos.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 24, kWidth = 32, kHeight = 16;
constexpr double kRotation = 2.3, kStrength = 1.7;
constexpr double kNear = 0.04;  ///< a fifth of a texel

/// A ball on a ground in a room with two windows.
Scene room(double grey, double rotation, double strength) {
  std::vector<Colorf> pixels(kWidth * kHeight, Colorf(0.15f));
  for (int y = 3; y < 6; ++y)
    for (int x = 4; x < 8; ++x) pixels[y * kWidth + x] = Colorf(6, 5, 4);
  for (int y = 5; y < 7; ++y)
    for (int x = 19; x < 21; ++x) pixels[y * kWidth + x] = Colorf(3, 4, 6);
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  place(builder, sphere_mesh(0.8), builder.add_material(matte("Ball", grey)),
        translation({0, 0, 0.8}));
  add_view(builder, {0, -5, 2.5}, {0, 0, 0.6});
  World world;
  world.values.color = Color<double>(1);
  world.values.strength = strength;
  world.values.rotation = rotation;
  world.map = std::make_shared<EnvironmentMap>(kWidth, kHeight, pixels);
  builder.appearance.world = world;
  return builder.build();
}

std::vector<UnknownParameter> wanted(double low = -2 * kPi<double>, double high = 2 * kPi<double>) {
  return {{kWorldName, "rotation", {std::clamp(0.0, low, high)}, low, high, 0.03},
          {kWorldName, "strength", {1}, 0.001, 1000, 0.03},
          {"Ball", "base_color", {0.4, 0.4, 0.4}, 0, 1, 0.03}};
}

FitSettings settings_for(const char* search) {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = 24;
  settings.spp = 16;
  settings.refinement_spp = 256;
  settings.search = search;
  return settings;
}

Vector found(double start_grey, const std::vector<UnknownParameter>& unknowns, const char* search) {
  const Scene truth = room(0.7, kRotation, kStrength);
  Fit fit(room(start_grey, 0, 1), taken_photos(truth, kSize, 2048), unknowns, settings_for(search));
  while (fit.step()) {
  }
  return fit.result().best;
}

TEST(RotationStart, AFitFindsARotationFromAnyStart) {
  const Vector x = found(0.4, wanted(), "auto");
  EXPECT_NEAR(x[0], kRotation, kNear);
  EXPECT_NEAR(x[1], kStrength, 0.05 * kStrength);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(x[2 + c], 0.7, 0.05 * 0.7);
}

TEST(RotationStart, WithoutASearchItBeginsWhereTheUserSays) {
  std::vector<UnknownParameter> near = wanted();
  near[0].start = {kRotation - 0.08};
  EXPECT_NEAR(found(0.4, near, "off")[0], kRotation, kNear);
  EXPECT_GT(std::abs(found(0.4, wanted(), "off")[0] - kRotation), 0.3);
}

TEST(RotationStart, StaysWithinItsBounds) {
  const double turn = 2 * kPi<double>;
  EXPECT_NEAR(found(0.4, wanted(kRotation - turn - 1, kRotation - turn + 1), "auto")[0],
              kRotation - turn, kNear);
}

}  // namespace
}  // namespace selenite
