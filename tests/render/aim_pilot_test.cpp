// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/aim_pilot.h"

#include <gtest/gtest.h>

#include "render/media_scenes.h"
#include "render/picture_statistics.h"

// At which lamps paths inside a medium aim is decided by a pilot of the scene.
namespace selenite {
namespace {

Light lamp_of(double radius, const Vec3d& from = {1, -2, 3}) {
  Light lamp;
  lamp.name = "Lamp";
  lamp.kind = LightKind::kPoint;
  lamp.values.power = 400;
  lamp.radius = radius;
  lamp.to_world = looking_at(from, {0, 0, 0});
  return lamp;
}

/// A ball of rough glass with a medium.
Scene ball(const std::vector<Light>& lamps, double world = 0) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 16), builder.add_material(filled_glass(0.3, 1.5, 2, 0.9, 0)));
  for (const Light& lamp : lamps) builder.add_light(lamp);
  if (world > 0) set_sky(builder, world);
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  return builder.build();
}

std::vector<bool> aims_of(const Scene& scene, std::vector<AimVerdict>* verdicts = nullptr,
                          int threads = 1) {
  RenderSettings like;
  like.threads = threads;
  const Scene decided = decide_aims(scene, scene.cameras.front(), SlotLayout(), like, verdicts);
  EXPECT_FALSE(has_undecided_aims(decided));
  std::vector<bool> aims;
  for (const Light& lamp : decided.appearance.lights) aims.push_back(*lamp.aimed);
  return aims;
}

TEST(AimPilot, AimsAtASmallLampAndNotAtALargeOne) {
  EXPECT_EQ(aims_of(ball({lamp_of(0.03)})), std::vector<bool>{true});
  EXPECT_EQ(aims_of(ball({lamp_of(1.5)})), std::vector<bool>{false});
}

// Once one is aimed at, another costs little more; but a lamp of 1.3 sr is found by chance.
TEST(AimPilot, LeavesTheLargestOut) {
  EXPECT_EQ(aims_of(ball({lamp_of(2.4), lamp_of(0.03)})), (std::vector<bool>{false, true}));
}

TEST(AimPilot, DoesNotAimWhereTheLampIsLostBesideTheWorld) {
  Light dim = lamp_of(0.1);
  dim.values.power = 0.05;
  EXPECT_EQ(aims_of(ball({dim}, 1)), std::vector<bool>{false});
}

TEST(AimPilot, DecidesAlikeWhateverTheThreads) {
  const Scene scene = ball({lamp_of(0.4)});
  EXPECT_EQ(aims_of(scene, nullptr, 1), aims_of(scene, nullptr, 2));
}

TEST(AimPilot, LeavesADecisionAsItIs) {
  Light lamp = lamp_of(0.03);
  lamp.aimed = false;
  EXPECT_EQ(aims_of(ball({lamp})), std::vector<bool>{false});
}

TEST(AimPilot, TakesOverWhatIsKnownOfALampOfThatSize) {
  const Scene scene = ball({lamp_of(0.03)});
  std::vector<AimVerdict> verdicts;
  EXPECT_EQ(aims_of(scene, &verdicts), std::vector<bool>{true});
  ASSERT_EQ(verdicts.size(), 1u);
  verdicts[0].aimed = false;
  EXPECT_EQ(aims_of(scene, &verdicts), std::vector<bool>{false}) << "no second pilot";
  verdicts[0].solid_angle *= 3;
  EXPECT_EQ(aims_of(scene, &verdicts), std::vector<bool>{true}) << "another size has its own";
}

TEST(AimPilot, HasNothingToDecideWithoutAMedium) {
  SceneBuilder builder;
  place(builder, sphere_mesh(1, 16), builder.add_material(glass("Glass")));
  builder.add_light(lamp_of(0.03));
  add_view(builder, {0, -5, 0}, {0, 0, 0}, 60);
  EXPECT_EQ(aims_of(builder.build()), std::vector<bool>{false});
}

TEST(AimPilot, RendersTheMeanWhateverIsDecided) {
  Light lamp = lamp_of(0.5);
  const auto mean = [&](bool aimed) {
    lamp.aimed = aimed;
    return mean_of(render_view(ball({lamp}), settings_of(24, 512)));
  };
  const Estimate with = mean(true), without = mean(false);
  EXPECT_LT(std::abs(with.z(without)), 4) << with.mean << " and " << without.mean;
}

}  // namespace
}  // namespace selenite
