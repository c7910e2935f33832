// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <map>
#include <numeric>

#include "fit/image_scenes.h"
#include "fit/run/fit.h"
#include "fit/smoke.h"
#include "fit/synthetic_renderer.h"
#include "fit/taken_photos.h"

namespace selenite {
namespace {

using Samples = std::map<PhaseKind, double>;

Samples planned(const std::vector<PlannedRenders>& plan) {
  Samples samples;
  for (const PlannedRenders& one : plan) samples[one.phase] += one.samples();
  return samples;
}

double sum(const Samples& samples) {
  return std::accumulate(samples.begin(), samples.end(), 0.0,
                         [](double all, const auto& one) { return all + one.second; });
}

/// What a fit says it will render, and what it renders.
struct Course {
  Samples planned, rendered;
  FitResult result;

  Course(const Scene& scene, const std::vector<Photo>& photos,
         const std::vector<UnknownParameter>& unknowns, const FitSettings& settings) {
    std::vector<Photo> sizes;
    for (const Photo& photo : photos)
      sizes.push_back(photo_of_size(photo.camera, photo.width, photo.height));
    FitProblem problem(scene, sizes, unknowns, settings);
    const Strategy strategy(problem);
    planned = selenite::planned(Fit::plan(problem, strategy));
    Fit fit(scene, photos, unknowns, settings);
    for (bool more = true; more;) {
      const PhaseKind phase = fit.result().phase;
      const double before = static_cast<double>(fit.result().samples);
      more = fit.step();
      rendered[phase] += static_cast<double>(fit.result().samples) - before;
    }
    result = fit.result();
  }
};

/// Exactly so many samples of that phase.
void expect_equal(const Course& course, PhaseKind phase) {
  EXPECT_EQ(course.planned.at(phase), course.rendered.at(phase)) << phase_text(phase);
}

void expect_within(const Course& course, double share) {
  EXPECT_NEAR(sum(course.planned) / sum(course.rendered), 1, share);
}

std::vector<Photo> two_photos(const Scene& scene, int size = kSyntheticSize) {
  return {synthetic_capture(scene, "Left", size, 64), synthetic_capture(scene, "Right", size, 64)};
}

TEST(RenderPlan, OfAdamIsWhatItRenders) {
  const Scene scene = synthetic_scene();
  FitSettings settings = synthetic_settings();
  settings.iterations = 7;
  settings.finite_differences = true;  // of an IOR that refracts sharply
  std::vector<UnknownParameter> unknowns = synthetic_unknowns();
  const Course rough(scene, two_photos(scene), unknowns, settings);
  expect_equal(rough, PhaseKind::kDescent);
  EXPECT_EQ(rough.planned.size(), 1u);
  unknowns[1].start = {0.1};
  unknowns[2].start = {0.9};
  const Course sharp(scene, two_photos(scene), unknowns, settings);
  expect_equal(sharp, PhaseKind::kDescent);
  EXPECT_GT(sum(sharp.planned), 1.5 * sum(rough.planned)) << "an IOR by two more pictures";
}

// Eight iterations: values have settled after ten at the earliest.
TEST(RenderPlan, OfGaussNewtonIsWhatItRenders) {
  const Scene scene = synthetic_scene();
  FitSettings settings = exact_settings(SyntheticRenderer{0.5, 0.5}, 8);
  settings.finite_differences = true;
  settings.search = "off";
  settings.spp = 8;
  const Course course(scene, two_photos(scene), synthetic_unknowns(), settings);
  EXPECT_EQ(course.result.iterations, 8);
  EXPECT_EQ(course.result.report.passes, 3);
  expect_equal(course, PhaseKind::kDescent);
  expect_equal(course, PhaseKind::kRefinement);
}

// Four parameters, of which many sets look alike: most candidates end in basins of their own.
TEST(RenderPlan, OfASearchIsWhatItRenders) {
  Scene truth = glass_sphere(1.45, {0.5f, 0.5f, 0.5f, 0.5f});
  truth.appearance.materials[0].maps.clear();
  FitSettings settings;
  settings.iterations = 8;
  settings.tolerance = 0;
  settings.threads = 1;
  const Course course(truth, taken_photos(truth, 20, 64),
                      {{"Board", "base_color", {0.2, 0.2, 0.2}, 0.001, 0.999, 0.03},
                       {"Board", "roughness", {0.5}, 0.02, 0.999, 0.03},
                       {"Board", "transmission", {0.1}, 0.001, 0.999, 0.03},
                       {"Board", "ior", {1.6}, 1.1, 2.5, 0.03}},
                      settings);
  ASSERT_GT(course.result.search.points, 0);
  expect_equal(course, PhaseKind::kDescent);
  expect_within(course, 0.15);
}

// Without instruments of an optimiser a refinement gathers its own.
TEST(RenderPlan, OfARefinementAfterAdamIsWhatItRenders) {
  const Scene scene = synthetic_scene();
  FitSettings settings = synthetic_settings({0.2, 0.2});
  settings.finite_differences = true;
  settings.iterations = 40;
  settings.refinement = "on";
  const Course course(scene, two_photos(scene), roughness_from(0.45), settings);
  ASSERT_EQ(course.result.report.passes, 3);
  expect_equal(course, PhaseKind::kDescent);
  expect_equal(course, PhaseKind::kRefinement);
}

// Values that have settled end the descent: the expectation is what most fits do.
TEST(RenderPlan, OfALongFitEndsWhereMostHaveSettled) {
  const Scene scene = synthetic_scene();
  FitSettings settings = exact_settings(SyntheticRenderer{}, 15);
  const auto samples = [&](int iterations) {
    settings.iterations = iterations;
    FitProblem problem(scene, two_photos(scene), synthetic_unknowns(), settings);
    const Strategy strategy(problem);
    return planned(Fit::plan(problem, strategy)).at(PhaseKind::kDescent);
  };
  EXPECT_EQ(samples(15), samples(100));
  EXPECT_LT(samples(10), samples(15));
  settings.refinement = settings.search = "off";
  EXPECT_LT(samples(15), 0.3 * samples(100)) << "nothing else ends it";
}

std::vector<float> coloured(int voxels) { return std::vector<float>(3 * voxels, 0.7f); }

UnknownParameter albedo() { return {"Smoke", "albedo_grid", {}, 0, 1, 0.03}; }
UnknownParameter extinction() { return {"Smoke", "extinction", {4, 4, 4}, 0.1, 20, 0.1}; }

FitSettings field_settings(int iterations) {
  FitSettings settings;
  settings.iterations = iterations;
  settings.tolerance = 0;
  settings.threads = 1;
  return settings;
}

TEST(RenderPlan, OfAGridByAdamIsWhatItRenders) {
  const Scene scene = smoke(std::vector<float>(8, 0.5f));
  const Course course(scene, taken_photos(scene, 12, 16), {albedo()}, field_settings(12));
  expect_equal(course, PhaseKind::kDescent);
}

TEST(RenderPlan, OfAGridBesideScalarsWithoutASearchIsWhatItRenders) {
  const Scene scene = smoke(coloured(8), 3);
  FitSettings settings = field_settings(14);
  settings.search = "off";
  const Course course(scene, taken_photos(scene, 12, 16), {extinction(), albedo()}, settings);
  expect_equal(course, PhaseKind::kDescent);
}

// Voxels are stepped together with the scalars, in half of the iterations.
TEST(RenderPlan, OfAGridBesideScalarsIsWhatItRenders) {
  std::vector<float> truth = coloured(8);
  for (std::size_t i = 0; i < 12; ++i) truth[i] = 0.5f;
  const Scene scene = smoke(coloured(8), 3);
  FitSettings settings = field_settings(32);
  settings.spp = 12;
  const Course course(scene, taken_photos(smoke(truth, 3), 16, 64), {extinction(), albedo()},
                      settings);
  ASSERT_EQ(course.result.iterations, 16);
  expect_equal(course, PhaseKind::kDescent);
  EXPECT_NEAR(
      course.planned.at(PhaseKind::kRefinement) / course.rendered.at(PhaseKind::kRefinement), 1,
      0.15);
  expect_within(course, 0.15);
}

// Texels alone in a quarter of the iterations, then a refinement of both.
TEST(RenderPlan, OfAnImageBesideScalarsIsWhatItRenders) {
  FitSettings settings = field_settings(20);
  settings.spp = 8;
  const Course course(board({0.5f, 0.5f, 0.5f, 0.5f}),
                      taken_photos(board({0.2f, 0.4f, 0.6f, 0.8f}), 24), {roughness(), texels()},
                      settings);
  ASSERT_EQ(course.result.iterations, 5);
  expect_equal(course, PhaseKind::kDescent);
  expect_within(course, 0.15);
}

// Blocks of texels and of scalars, and at a high roughness a comparison with a low one.
TEST(RenderPlan, OfManyTexelsBesideScalarsIsWhatItRenders) {
  const Scene scene = with_many_texels(board({0.5f, 0.5f, 0.5f, 0.5f}), 0.5f);
  FitSettings settings = field_settings(40);
  settings.spp = 8;
  const Course course(scene, taken_photos(board({0.2f, 0.4f, 0.6f, 0.8f}), 24),
                      {roughness(), texels()}, settings);
  ASSERT_EQ(course.result.iterations, 40);
  expect_within(course, 0.15);
}

// The IOR is found by renders at both sides of it before each block of scalars.
TEST(RenderPlan, OfAnImageInGlassIsWhatItRenders) {
  FitSettings settings = field_settings(20);
  settings.spp = 16;
  const Course course(with_many_texels(glass_sphere(1.8, {0.5f, 0.5f, 0.5f, 0.5f}), 0.5f),
                      taken_photos(glass_sphere(1.45, {0.9f, 0.6f, 0.7f, 0.8f}), 24),
                      {texels(), {"Board", "ior", {1.8}, 1.1, 2.5, 0.03}}, settings);
  ASSERT_EQ(course.result.iterations, 20);
  // With two parameters more candidates end in the same basin than most fits have.
  expect_within(course, 0.2);
}

/// Smoke with side^3 voxels of an albedo each, and as many densities.
Scene smoke_of(int side, int channels, bool even, bool even_densities = true) {
  Scene scene = smoke(std::vector<float>(8, 0.5f));
  const auto grid = [&](int numbers, bool constant) {
    const auto voxels = static_cast<std::size_t>(side) * side * side * numbers;
    std::vector<float> values(voxels, 0.5f);
    if (!constant) values[0] = 0.6f;
    return std::make_shared<Grid>("grid", std::array<int, 3>{side, side, side}, numbers, values);
  };
  Material& material = scene.appearance.materials[0];
  material.albedo_grid.grid = grid(channels, even);
  material.density_grid = {grid(1, even_densities), material.albedo_grid.to_unit};
  return scene;
}

double samples_of(const Scene& scene, std::vector<UnknownParameter> fields, FitSettings settings,
                  int size = 64) {
  fields.insert(fields.begin(), extinction());
  FitProblem problem(scene, {photo_of_size("Camera 0", size, size)}, fields, settings);
  const Strategy strategy(problem);
  return sum(planned(Fit::plan(problem, strategy)));
}

UnknownParameter density() { return {"Smoke", "density_grid", {}, 0, 10, 0.03}; }

TEST(RenderPlan, OfGridsSearchesWhereNothingIsKnownOfTheVoxels) {
  const auto samples = [&](const std::vector<UnknownParameter>& fields, bool even,
                           bool even_densities, const char* search, int size = 64) {
    FitSettings settings = field_settings(40);
    settings.search = search;
    return samples_of(smoke_of(4, 3, even, even_densities), fields, settings, size);
  };
  const std::vector<UnknownParameter> one{albedo()}, both{albedo(), density()};
  EXPECT_GT(samples(one, true, true, "auto") - samples(one, true, true, "off"),
            0.1 * samples(one, true, true, "auto"));
  EXPECT_EQ(samples(one, false, true, "auto"), samples(one, false, true, "off"));
  EXPECT_GT(samples(both, true, true, "auto"), samples(both, true, true, "off"));
  EXPECT_EQ(samples(both, true, false, "auto"), samples(both, true, false, "off"));
}

TEST(RenderPlan, OfFewColouredVoxelsStepsThemWithTheScalarsAndRefines) {
  const auto samples = [&](int side, int channels = 3, int iterations = 40) {
    return samples_of(smoke_of(side, channels, true), {albedo()}, field_settings(iterations));
  };
  EXPECT_EQ(samples(12), samples(2)) << "a path is a path";
  EXPECT_EQ(samples(13), samples(4, 1)) << "these are left to Adam";
  EXPECT_NE(samples(12), samples(13));
  // Steps, validations and samples of the passes grow with the iterations; the search does not.
  // Below 320 the first pass has its least samples.
  const double first = samples(12, 3, 640) - samples(12, 3, 320);
  EXPECT_NEAR(samples(12, 3, 1280) - samples(12, 3, 640), 2 * first, 0.05 * 2 * first);
}

TEST(RenderPlan, CountsAWholeFitOfSeveralPhotosByTheirPixels) {
  const Scene scene = synthetic_scene();
  const FitSettings settings = synthetic_settings();
  const auto samples = [&](const std::vector<Photo>& photos) {
    FitProblem problem(scene, photos, synthetic_unknowns(), settings);
    const Strategy strategy(problem);
    return sum(planned(Fit::plan(problem, strategy)));
  };
  const Photo left = photo_of_size("Left", 30, 20), right = photo_of_size("Right", 20, 15);
  EXPECT_DOUBLE_EQ(samples({left, right}), 1.5 * samples({left}));
}

// The pictures of a search stay small: what it adds is the same at all sizes.
TEST(RenderPlan, OfASearchDoesNotGrowWithThePhotos) {
  const Scene scene = synthetic_scene();
  FitSettings settings = synthetic_settings();
  settings.optimiser = "gauss-newton";
  settings.search = "on";
  const auto of_search = [&](int size) {
    FitProblem problem(scene, {photo_of_size("Left", size, size)}, synthetic_unknowns(), settings);
    const Strategy strategy(problem);
    return planned(Fit::plan(problem, strategy)).at(PhaseKind::kMultiStart);
  };
  EXPECT_EQ(of_search(64), of_search(512));
  EXPECT_EQ(of_search(20), of_search(64) / 4) << "nor is a photo enlarged";
}

}  // namespace
}  // namespace selenite
