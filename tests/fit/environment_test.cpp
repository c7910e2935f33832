// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "fit/phases/starts/light_start.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/uniform_fields.h"
#include "fit/run/fit.h"
#include "fit/solver/field_prior.h"
#include "fit/taken_photos.h"
#include "scene/small_scenes.h"

namespace selenite {
namespace {

constexpr int kSize = 24, kWidth = 8, kHeight = 4;

/// A ball on a known ground under a sky with a bright side.
Scene stage(double grey, const std::vector<Colorf>& pixels) {
  SceneBuilder builder;
  place(builder, quad_mesh(20), builder.add_material(matte("Floor", 0.5)));
  place(builder, sphere_mesh(0.8), builder.add_material(matte("Ball", grey)),
        translation({0, 0, 0.8}));
  add_view(builder, {0, -5, 2.5}, {0, 0, 0.6});
  add_view(builder, {4, 3, 2.5}, {0, 0, 0.6});
  World world;
  world.values.color = Color<double>(1);
  world.map = std::make_shared<EnvironmentMap>(kWidth, kHeight, pixels);
  builder.appearance.world = world;
  return builder.build();
}

std::vector<Colorf> bright_side() {
  std::vector<Colorf> pixels(kWidth * kHeight, Colorf(0.3f, 0.35f, 0.4f));
  pixels[kWidth + 2] = Colorf(6, 5, 4);
  return pixels;
}

std::vector<Colorf> even(float level) {
  return std::vector<Colorf>(kWidth * kHeight, Colorf(level));
}

std::vector<Photo> photos() {
  std::vector<Photo> taken;
  const Scene scene = stage(0.7, bright_side());
  for (int i = 0; i < 2; ++i) {
    Photo photo = photo_of_size("Camera " + std::to_string(i), kSize, kSize);
    photo.reference = render(scene, scene.cameras[static_cast<std::size_t>(i)], {},
                             square_settings(kSize, 1024, 40 + static_cast<std::uint64_t>(i)))
                          .mean;
    taken.push_back(std::move(photo));
  }
  check_photos(scene, taken);
  return taken;
}

const std::vector<UnknownParameter> kWanted = {{"Ball", "base_color", {0.4, 0.4, 0.4}, 0, 1, 0.03},
                                               {kWorldName, kEnvironment, {}, 0, 1e4, 0.03}};

FitSettings settings_for(int iterations) {
  FitSettings settings;
  settings.threads = 1;
  settings.iterations = iterations;
  settings.spp = 8;
  settings.refinement_spp = 256;
  return settings;
}

// A sky has no first column.
TEST(UnknownEnvironment, LooksAlikeToItsPriorHoweverItIsTurned) {
  const Scene scene = stage(0.4, even(1));
  const Fields fields(scene, {kWanted[1]});
  FieldPrior prior(fields, FieldNumbers(fields, 1));
  prior.begin(fields.start()[0]);
  const Eigen::MatrixXd& precision = prior.precision()->dense;
  const auto between = [&](int y, int x, int other_y, int other_x) {
    return precision(y * kWidth + x % kWidth, other_y * kWidth + other_x % kWidth);
  };
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      EXPECT_NEAR(between(y, x, y, x + 1), between(y, 0, y, 1), 1e-9 * precision(0, 0)) << x;
      EXPECT_NEAR(between(y, x, y, x), between(y, 0, y, 0), 1e-9 * precision(0, 0)) << x;
    }
}

TEST(UnknownEnvironment, ASavedPriorComesBack) {
  const Scene scene = stage(0.4, even(1));
  const Fields fields(scene, {kWanted[1]});
  const FieldNumbers numbers(fields, 1);
  FieldPrior prior(fields, numbers), resumed(fields, numbers);
  prior.begin(fields.start()[0]);
  SavedState writing;
  prior.members(writing);
  SavedState reading(writing.sealed());
  resumed.members(reading);
  EXPECT_EQ(resumed.mean(), prior.mean());
  const Eigen::VectorXd now = 2 * prior.mean();
  const Eigen::VectorXd known = Eigen::VectorXd::Ones(kWidth * kHeight);
  prior.adapt(now, known);
  resumed.adapt(now, known);
  EXPECT_EQ(resumed.precision()->dense, prior.precision()->dense);
  EXPECT_EQ(resumed.longest_steps(prior.mean()), prior.longest_steps(prior.mean()));
}

/// Beside a lamp a pixel may differ more from its neighbours, elsewhere as much as before.
TEST(UnknownEnvironment, ALampMayBeBrighterThanItsNeighbours) {
  const Fields fields(stage(0.4, even(1)), {kWanted[1]});
  FieldPrior prior(fields, FieldNumbers(fields, 1));
  prior.begin(fields.start()[0]);
  const Eigen::MatrixXd before = prior.precision()->dense;
  Eigen::VectorXd lit = prior.mean();
  constexpr int kLamp = kWidth + 2;
  lit.segment<3>(3 * kLamp).setConstant(99);
  Eigen::VectorXd known = Eigen::VectorXd::Zero(kWidth * kHeight);
  prior.adapt(lit, known);
  EXPECT_EQ(prior.precision()->dense, before);  // no photo has seen it
  known[kLamp] = 1e6;
  prior.adapt(lit, known);
  // What is left holds the mean of the sphere.
  EXPECT_LT(prior.precision()->dense(kLamp, kLamp), before(kLamp, kLamp) / 5);
  EXPECT_EQ(prior.precision()->dense(kLamp + 3, kLamp + 4), before(kLamp + 3, kLamp + 4));
}

/// The ground is known, so that light and albedo are both found from one even sky of another level.
TEST(UnknownEnvironment, AKnownGroundTellsLightFromAlbedo) {
  for (const char* search : {"auto", "off"}) {
    FitSettings settings = settings_for(40);
    settings.search = search;
    Fit fit(stage(0.4, even(1)), photos(), kWanted, settings);
    while (fit.step()) {
    }
    const FitResult& result = fit.result();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(result.best[c], 0.7, 0.05 * 0.7) << search << c;
    const Vector& light = result.fields_best->front();
    EXPECT_GE(light.minCoeff(), 0);
    // The bright side, with its neighbours between which it is interpolated.
    const auto pixel = [&](int x, int y) { return light[3 * (y * kWidth + x)]; };
    EXPECT_GT(pixel(2, 1), 3) << search;
    EXPECT_LT(pixel(6, 1), 0.7) << search;
  }
}

/// Nothing else is fitted: light is solved for all the same.
TEST(UnknownEnvironment, LightAloneIsSolvedFor) {
  for (const char* search : {"auto", "off"}) {
    FitSettings settings = settings_for(8);
    settings.search = search;
    Fit fit(stage(0.7, even(1)), photos(), {kWanted[1]}, settings);
    while (fit.step()) {
    }
    const FitResult& result = fit.result();
    EXPECT_EQ(result.stopped, StopReason::kIterations) << result.message;
    EXPECT_GT(result.fields_best->front()[3 * (kWidth + 2)], 3) << search;
    EXPECT_LT(result.best_validation, 0.01) << search;
  }
}

/// Errors of one size, of single cells or of whole blocks, beside photos that are right: what neighbours
/// share says less of the light, which stays the smoother.
TEST(UnknownEnvironment, WhatNeighboursShareCountsOnce) {
  const FitProblem problem(stage(0.7, even(1)), photos(), kWanted, settings_for(20));
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(problem), problem.settings(), counts);
  const auto precision_of = [&](int side) {
    auto newton = FieldGaussNewton::of(problem.fields(), problem.photos());
    newton->set_values(problem.start().fields);
    for (std::size_t i = 0; i < problem.photos().size(); ++i) {
      const Photo& photo = problem.photos()[i];
      newton->gather(i, evaluator.field_jacobian(problem.start(), photo, problem.fields(),
                                                 newton->shares(i), newton->cell(), {64, 5}));
      Halves halves;
      halves.residual_a = Eigen::VectorXf(3 * kSize * kSize);
      for (int p = 0; p < kSize * kSize; ++p) {
        const std::uint32_t block =
            static_cast<std::uint32_t>(p / kSize / side * 97 + p % kSize / side);
        const float sign =
            (block * 2654435761u + 7u * static_cast<std::uint32_t>(i)) >> 31 ? 1.f : -1.f;
        halves.residual_a.segment<3>(3 * p).setConstant(0.1f * sign);
      }
      halves.residual_b = halves.residual_a;
      halves.variance = Eigen::VectorXf::Zero(halves.residual_a.size());
      newton->add_residual(i, halves, relative_weights(photo, 2), 0);
    }
    newton->solve(1);
    return newton->prior_strength();
  };
  EXPECT_GT(precision_of(6), 2 * precision_of(2));
}

/// Few passes of small pictures show where the light comes from, although the ball is too dark.
TEST(UnknownEnvironment, LightStartFindsTheBrightSide) {
  const FitProblem problem(stage(0.7, even(1)), photos(), kWanted, settings_for(20));
  const std::unique_ptr<LightStart> start = LightStart::of(problem, 3);
  ASSERT_TRUE(start);
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(problem), problem.settings(), counts);
  int passes = 1;
  while (start->step(evaluator)) ++passes;
  EXPECT_EQ(passes, LightStartOptions{}.passes);
  EXPECT_EQ(start->fraction(), 1);
  const Vector& light = start->fields().front();
  Eigen::Index brightest = 0;
  // Above the horizon: the ground hides what is below.
  light(Eigen::seq(0, 3 * 2 * kWidth - 1, Eigen::fix<3>)).maxCoeff(&brightest);
  EXPECT_EQ(brightest, kWidth + 2);
  EXPECT_GE(light.minCoeff(), 0);
}

/// What a multi-start varies is the colour by which the light is multiplied.
TEST(UnknownEnvironment, AMultiStartVariesTheColourOfTheLight) {
  const FitProblem problem(stage(0.4, even(1)), photos(), kWanted, settings_for(20));
  const auto uniform = problem.uniform();
  ASSERT_TRUE(uniform);
  Vector x = uniform->problem().unknowns.start();
  ASSERT_EQ(x.size(), 6);
  EXPECT_EQ(x.tail(3), Vector::Ones(3));
  FieldValues light = problem.fields().start();
  light[0][5] = 4;
  uniform->set_light(light);
  x.tail(3) = Vector{{2.0, 1.0, 0.5}};
  const Vector found = uniform->fields(x).front();
  EXPECT_EQ(found[0], 2);
  EXPECT_EQ(found[5], 2);
  EXPECT_EQ(found[8], 0.5);
  EXPECT_EQ(uniform->scene_at(x).appearance.world.map->pixels()[1].b, 4);
}

/// A metal ball alone under a sky of `width` pixels around.
Scene mirror_ball(double roughness, int width, const std::vector<Colorf>& pixels) {
  SceneBuilder builder;
  place(builder, sphere_mesh(0.8), builder.add_material(mirror("Ball", 0.8, roughness)));
  add_view(builder, {0, -4, 1}, {0, 0, 0});
  add_view(builder, {3.5, 2, 1}, {0, 0, 0});
  World world;
  world.values.color = Color<double>(1);
  world.map = std::make_shared<EnvironmentMap>(width, width / 2, pixels);
  builder.appearance.world = world;
  return builder.build();
}

/// Under five lamps of a few degrees.
std::vector<Photo> photos_of_mirror_ball(double roughness) {
  constexpr int kAround = 32;
  std::vector<Colorf> room(kAround * kAround / 2, Colorf(0.3f));
  for (const auto& [x, y] : {std::pair{5, 4}, {11, 6}, {20, 4}, {26, 9}, {15, 11}})
    for (int k = 0; k < 4; ++k)
      room[static_cast<std::size_t>((y + k / 2) * kAround + x + k % 2)] = Colorf(8);
  const Scene scene = mirror_ball(roughness, kAround, room);
  std::vector<Photo> taken;
  for (int i = 0; i < 2; ++i) {
    Photo photo = photo_of_size("Camera " + std::to_string(i), kSize, kSize);
    photo.reference = render(scene, scene.cameras[static_cast<std::size_t>(i)], {},
                             square_settings(kSize, 1024, 50 + static_cast<std::uint64_t>(i)))
                          .mean;
    taken.push_back(std::move(photo));
  }
  check_photos(scene, taken);
  return taken;
}

/// Blurred light on a sharper ball looks the same: of what explains the photos the roughest is taken. A fit
/// is resumed in the midst of that with the same bits.
TEST(UnknownEnvironment, ABodyIsAsRoughAsThePhotosAllow) {
  constexpr int kTexels = 16;
  constexpr double kTruth = 0.4;
  const std::vector<Colorf> grey(kTexels * kTexels / 2, Colorf(0.5f));
  const std::vector<UnknownParameter> wanted = {{"Ball", "roughness", {0.15}, 0.02, 1, 0.03},
                                                {kWorldName, kEnvironment, {}, 0, 1e4, 0.03}};
  const std::vector<Photo> taken = photos_of_mirror_ball(kTruth);
  FitSettings settings = settings_for(16);
  settings.search = "off";
  settings.seed = 4;
  Fit fit(mirror_ball(0.15, kTexels, grey), taken, wanted, settings);
  std::string state;
  double refined = 0;
  for (int steps = 0; fit.step();) {
    if (fit.result().phase != PhaseKind::kRoughnessProfile || ++steps != 12) continue;
    state = fit.saved();
    refined = fit.result().best[0];
  }
  EXPECT_LT(refined, kTruth - 0.05);
  EXPECT_NEAR(fit.result().best[0], kTruth, 0.08);
  EXPECT_FALSE(fit.result().report.components[0].determined);
  Fit other(mirror_ball(0.15, kTexels, grey), taken, wanted, settings);
  other.restore(state);
  while (other.step()) {
  }
  EXPECT_EQ(other.result().best, fit.result().best);
}

/// A fit is resumed in the midst of the light's first passes with the same bits.
TEST(UnknownEnvironment, ResumesAmidTheFirstPasses) {
  const auto run = [&](int resume_after) {
    FitSettings settings = settings_for(6);
    settings.refinement = "off";
    Fit fit(stage(0.4, even(1)), photos(), kWanted, settings);
    for (int i = 0; i < resume_after; ++i) fit.step();
    if (resume_after == 0) {
      while (fit.step()) {
      }
      return fit.result().best;
    }
    const std::string state = fit.saved();
    Fit other(stage(0.4, even(1)), photos(), kWanted, settings);
    other.restore(state);
    while (other.step()) {
    }
    return other.result().best;
  };
  const Vector whole = run(0);
  EXPECT_EQ(run(3), whole);
  EXPECT_EQ(run(8), whole);
}

}  // namespace
}  // namespace selenite
