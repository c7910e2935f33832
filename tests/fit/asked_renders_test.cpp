// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit asks the renderer for: the settings of the user, and seeds that no two purposes share.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "fit/given_evaluator.h"
#include "fit/phases/refinement.h"
#include "fit/run/fit.h"
#include "fit/smoke.h"
#include "fit/synthetic_renderer.h"
#include "fit/taken_photos.h"

namespace selenite {
namespace {

std::vector<Photo> both(const Scene& scene, int size = kSyntheticSize) {
  return {synthetic_capture(scene, "Left", size), synthetic_capture(scene, "Right", size)};
}

/// A fit through all of its phases whose renders are noted.
std::vector<RenderSettings> asked_by(FitSettings settings, std::vector<Photo> photos) {
  std::vector<RenderSettings> asked;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    asked.push_back(render_settings);
    // Pictures of what surfaces reflect at once, and no others, end there.
    EXPECT_EQ(render_settings.depth == 1, scene.appearance.materials[0].flavour.draws_reflections);
    return SyntheticRenderer{0.2, 0.2}(scene, camera, layout, render_settings, progress);
  };
  std::set<PhaseKind> phases;
  Fit fit(synthetic_scene(), std::move(photos), synthetic_unknowns(), settings);
  do phases.insert(fit.result().phase);
  while (fit.step());
  EXPECT_EQ(fit.result().message, "");
  for (const PhaseKind one : {PhaseKind::kMultiStart, PhaseKind::kDescent, PhaseKind::kRefinement})
    EXPECT_TRUE(phases.contains(one)) << "else its renders are not seen";
  return asked;
}

TEST(AskedRenders, HaveTheDepthAndThreadsOfTheSettingsInEveryPhase) {
  FitSettings settings = exact_settings({}, 20);
  settings.spp = 8;
  settings.depth = 5;
  settings.threads = 3;
  settings.finite_differences = true;
  const std::vector<RenderSettings> asked = asked_by(settings, both(synthetic_scene()));
  EXPECT_GT(asked.size(), 100u);
  for (const RenderSettings& one : asked) {
    EXPECT_TRUE(one.depth == 5 || one.depth == 1) << one.depth;
    EXPECT_EQ(one.threads, 3);
  }
}

TEST(AskedRenders, HaveTheFrameOfTheirPhoto) {
  std::vector<Photo> photos = both(synthetic_scene(), 24);
  photos[0].frame = {1.25, 50, 40};
  photos[1].frame = {1.5, 60, 40};
  FitSettings settings = exact_settings({}, 20);
  settings.spp = 8;
  std::set<std::pair<double, int>> whole, small;
  for (const RenderSettings& one : asked_by(settings, photos)) {
    if (one.width == 24)
      whole.insert({one.frame.aspect, one.frame.width});
    else
      small.insert({one.frame.aspect, one.frame.width});
  }
  EXPECT_EQ(whole, (std::set<std::pair<double, int>>{{1.25, 50}, {1.5, 60}}));
  for (const auto& [aspect, width] : small) {
    EXPECT_TRUE(aspect == 1.25 || aspect == 1.5) << "of the photo that was made smaller";
    EXPECT_EQ(width, 24);
  }
}

TEST(AskedRenders, AreOfThePixelsOfTheirPhotoAlone) {
  FitSettings settings = synthetic_settings();
  std::shared_ptr<const PixelMask> asked;
  settings.renderer = [&](const Scene& scene, const Camera& camera, const SlotLayout& layout,
                          const RenderSettings& render_settings, Progress* progress) {
    asked = render_settings.pixels;
    return SyntheticRenderer()(scene, camera, layout, render_settings, progress);
  };
  const FitProblem problem(synthetic_scene(), both(synthetic_scene()), synthetic_unknowns(),
                           settings);
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(problem), problem.settings(), counts);
  Photo photo = problem.photos()[0];
  PixelMask few(photo.size());
  few[3] = few[7] = 1;
  photo.pixels = std::make_shared<const PixelMask>(few);
  (void)evaluator.evaluate(problem.start(), photo, {4, 1});
  ASSERT_NE(asked, nullptr);
  EXPECT_EQ(*asked, few);
  EXPECT_EQ(counts.samples, 2 * 4) << "others are not paid for";
}

// Derivatives by voxels have a renderer of their own: light that is scattered once is not all of it.
TEST(AskedRenders, OfFieldsHaveTheDepthOfTheSettings) {
  const Scene scene = smoke(std::vector<float>(8, 0.9f));
  const auto first_loss = [&](int depth) {
    FitSettings settings;
    settings.iterations = 1;
    settings.spp = 32;
    settings.tolerance = 0;
    settings.threads = 1;
    settings.depth = depth;
    Fit fit(scene, taken_photos(scene, 8, 400), {{"Smoke", "albedo_grid", {}, 0, 1, 0.03}},
            settings);
    (void)fit.step();
    return fit.result().history.at(0).mean_bias.g;
  };
  EXPECT_NEAR(first_loss(0), 0, 0.02);
  EXPECT_LT(first_loss(1), -0.05);
}

/// Seeds that the passes of a refinement ask for: of pictures, and of derivatives.
struct Seeds {
  std::vector<std::uint64_t> pictures, derivatives;
};

Seeds seeds_of_refinement(std::uint64_t seed) {
  const Scene scene = synthetic_scene();
  std::vector<Photo> photos = both(scene, 12);
  check_photos(scene, photos);
  const Unknowns unknowns(scene, synthetic_unknowns());
  const SlotLayout layout = unknowns.layout(scene);
  const Problem problem{unknowns, layout, photos, losses()[0], 10};
  Seeds seeds;
  GivenEvaluator render([&](const Vector& at, const Photo& photo, int spp, std::uint64_t key,
                            std::optional<Differences> derivatives) {
    (derivatives ? seeds.derivatives : seeds.pictures).push_back(key);
    RenderSettings settings;
    settings.width = settings.height = 12;
    settings.spp = spp;
    settings.seed = key;
    const Scene now = unknowns.scene_with(scene, at);
    return SyntheticRenderer{0.5, 0.5}(now, now.camera(photo.camera),
                                       derivatives ? layout : SlotLayout(), settings, nullptr);
  });
  Vector off = synthetic_truth();
  off[0] += 0.05;
  Refinement refinement(problem, nullptr, {off}, seed, 64, 16);
  while (refinement.step(render)) {
  }
  EXPECT_GT(refinement.report().passes, 2);
  return seeds;
}

// What a pass finds must not hang on the noise by which the one before chose where it begins.
TEST(AskedRenders, OfARefinementShareNoSeed) {
  const Seeds seeds = seeds_of_refinement(7);
  std::set<std::uint64_t> all(seeds.pictures.begin(), seeds.pictures.end());
  EXPECT_EQ(all.size(), seeds.pictures.size()) << "two photos, three passes or more";
  EXPECT_GE(all.size(), 6u);
  const std::size_t pictures = all.size();
  all.insert(seeds.derivatives.begin(), seeds.derivatives.end());
  EXPECT_EQ(all.size(), pictures + seeds.derivatives.size());
  const Seeds other = seeds_of_refinement(8);
  for (const std::uint64_t seed : other.pictures) EXPECT_FALSE(all.contains(seed));
}

}  // namespace
}  // namespace selenite
