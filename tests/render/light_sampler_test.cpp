// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/prepared/light_sampler.h"

#include <gtest/gtest.h>

#include "scene/small_scenes.h"

// Which light of a scene is sampled, and with which probability.
namespace selenite {
namespace {

/// Two lamps, one black; two emissive plates, one weak; a world without an image.
Scene lit_scene() {
  SceneBuilder builder;
  for (const auto& [name, power] : {std::pair{"Key", 100.0}, std::pair{"Black", 0.0}}) {
    Light lamp;
    lamp.name = name;
    lamp.kind = LightKind::kPoint;
    lamp.values.power = power;
    lamp.to_world = translation({0, 0, 5});
    builder.add_light(lamp);
  }
  for (const auto& [name, strength] : {std::pair{"Strong", 2.0}, std::pair{"Weak", 0.25}}) {
    Material m = matte(name, 0.5);
    m.values.emission_strength = strength;
    place(builder, quad_mesh(1), builder.add_material(m), translation({0, 0, strength}));
  }
  place(builder, quad_mesh(3), builder.add_material(matte("Ground", 0.7)), translation({0, 0, -1}));
  add_view(builder, {0, -4, 1.5}, {0, 0, 0}, 45);
  set_sky(builder, 0.3);
  return builder.build();
}

constexpr int kKey = 0, kBlack = 1, kStrong = 0, kWeak = 1, kGround = 2;

LightSet all_of(LightUse use) { return {{use, use}, {use, use, LightUse::kNone}, use, {}}; }

/// The share of [0, 1) in which a light is chosen, by a fine and even grid.
double chosen(const LightSampler& sampler, LightSampler::Source source, int index) {
  constexpr int kSteps = 100000;
  int count = 0;
  for (int i = 0; i < kSteps; ++i) {
    const auto choice = sampler.choose((static_cast<float>(i) + 0.5f) / kSteps);
    if (choice.source != source || choice.index != index) continue;
    EXPECT_EQ(choice.probability, sampler.probability(index));
    ++count;
  }
  return static_cast<double>(count) / kSteps;
}

TEST(LightSampler, ChoosesWithTheProbabilityThatItTells) {
  const Scene scene = lit_scene();
  const LightSampler sampler(scene, all_of(LightUse::kSampled));
  using enum LightSampler::Source;
  EXPECT_GT(sampler.probability(kKey), 0.25f);
  EXPECT_GT(sampler.probability(sampler.mesh_source()), 0.25f);
  EXPECT_NEAR(chosen(sampler, kLamp, kKey), sampler.probability(kKey), 2e-5);
  EXPECT_NEAR(chosen(sampler, kMesh, sampler.mesh_source()),
              sampler.probability(sampler.mesh_source()), 2e-5);
  EXPECT_NEAR(sampler.probability(kKey) + sampler.probability(sampler.mesh_source()), 1, 1e-6);
}

TEST(LightSampler, WhatIsBlackIsSampledOnlyForItsDerivative) {
  const Scene scene = lit_scene();
  EXPECT_EQ(LightSampler(scene, all_of(LightUse::kSampled)).probability(kBlack), 0);
  const LightSampler sampler(scene, all_of(LightUse::kDifferentiated));
  EXPECT_GT(sampler.probability(kBlack), 0.1f);
  EXPECT_EQ(sampler.probability(sampler.world_source()), 0);  // it has no image
}

TEST(LightSampler, WhatIsNotInTheSetIsNeverChosen) {
  const Scene scene = lit_scene();
  LightSet set = all_of(LightUse::kSampled);
  set.lamps[kKey] = LightUse::kNone;
  const LightSampler meshes(scene, set);
  EXPECT_EQ(meshes.probability(kKey), 0);
  EXPECT_EQ(meshes.probability(meshes.mesh_source()), 1);

  set = all_of(LightUse::kSampled);
  set.materials[kStrong] = LightUse::kNone;
  const LightSampler weak(scene, set);
  EXPECT_FALSE(weak.samples(kStrong));
  EXPECT_TRUE(weak.samples(kWeak));
  EXPECT_FALSE(weak.samples(kGround));
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(weak.choose_triangle(static_cast<float>(i) / 100).material, kWeak);

  const LightSampler none(scene, {{LightUse::kNone, LightUse::kNone},
                                  {LightUse::kNone, LightUse::kNone, LightUse::kNone},
                                  LightUse::kNone,
                                  {}});
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(none.choose(static_cast<float>(i) / 100).source, LightSampler::Source::kNone);
}

TEST(LightSampler, TrianglesAreChosenByAreaAndEmission) {
  const Scene scene = lit_scene();
  const LightSampler sampler(scene, all_of(LightUse::kSampled));
  constexpr int kSteps = 100000;
  int strong = 0;
  for (int i = 0; i < kSteps; ++i)
    strong += sampler.choose_triangle((static_cast<float>(i) + 0.5f) / kSteps).material == kStrong;
  EXPECT_NEAR(static_cast<double>(strong) / kSteps, 2 / 2.25, 2e-5);
}

TEST(LightSampler, CyclesLeavesOutWeakSurfaces) {
  const Scene scene = lit_scene();
  LightSet set = all_of(LightUse::kSampled);
  set.materials[kStrong] = LightUse::kNone;
  const LightSampler weak(scene, set);
  EXPECT_GT(weak.probability(weak.mesh_source()), 0.25f);
  EXPECT_EQ(weak.probability(weak.mesh_source(), true), 0);
  EXPECT_EQ(weak.probability(kKey, true), 1);
  Surface surface{.position = {}, .ng = {0, 0, 1}, .n = {0, 0, 1}, .material = kWeak, .offset = 0};
  const Vec3f away{0, 0, 2};
  EXPECT_GT(weak.mesh_density(surface, away, false), 0);
  EXPECT_EQ(weak.mesh_density(surface, away, true), 0);
}

}  // namespace
}  // namespace selenite
