// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/absent_weights.h"

#include <gtest/gtest.h>

#include "fit/run/fit.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr double kRoughness = 0.5;

/// Pictures of roughness r and transmission t: r (1 - t), and by `shows` t more in every second pixel,
/// less in the others.
struct Valley {
  double shows = 0, noise = 0.1;

  double value(double r, double t, std::size_t pixel) const {
    return r * (1 - t) + (pixel % 2 == 0 ? shows : -shows) * t;
  }
  Film operator()(const Scene& scene, const Camera&, const SlotLayout& layout,
                  const RenderSettings& settings, Progress*) const {
    const Principled<double>& values = scene.appearance.materials[0].values;
    const double r = values.roughness, t = values.transmission;
    return evenly_noisy_film(layout, settings, noise, [&, this](std::size_t i) {
      return std::pair(value(r, t, i), std::array{1 - t, value(r, 1, i) - value(r, 0, i)});
    });
  }
  Photo photo(double t) const {
    Photo photo = grey_capture();
    for (std::size_t i = 0; i < photo.reference.size(); ++i)
      photo.reference[i] = Colorf(static_cast<float>(value(kRoughness, t, i)));
    return photo;
  }
};

FitResult fitted(const Valley& valley, double truth, std::uint64_t seed) {
  FitSettings settings = exact_settings(valley, 20);
  settings.search = "off";
  settings.seed = seed;
  Fit fit(synthetic_scene(), {valley.photo(truth)},
          {{"Body", "roughness", {0.6}, 0.02, 0.999, 0.03},
           {"Body", "transmission", {0.25}, 0, 1, 0.03}},
          settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().message, "");
  return fit.result();
}

// Transmission and roughness make up for each other wholly.
TEST(AbsentWeights, WhatThePhotosDoNotTellFromNothingIsNotThere) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const FitResult found = fitted({}, 0, seed);
    EXPECT_EQ(found.best[1], 0) << seed;
    EXPECT_NEAR(found.best[0], kRoughness, 0.01) << seed;
    EXPECT_FALSE(found.report.components[1].determined) << seed;
  }
}

TEST(AbsentWeights, WhatShowsStays) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const FitResult found = fitted({.shows = 0.4}, 0.3, seed);
    EXPECT_NEAR(found.best[1], 0.3, 0.02) << seed;
    EXPECT_NEAR(found.best[0], kRoughness, 0.02) << seed;
    EXPECT_TRUE(found.report.components[1].determined) << seed;
  }
}

TEST(AbsentWeights, OthersMakeUpForThemByTheirCovariance) {
  const Scene scene = synthetic_scene();
  const Unknowns unknowns(scene, {{"Body", "specular_level", {0.5}, 0, 1, 0.03},
                                  {"Body", "transmission", {0.1}, 0, 1, 0.03},
                                  {"Body", "metallic", {0.4}, 0, 1, 0.03}});
  TrustReport report;
  report.components = {{.standard_error = 0.1, .determined = true},
                       {.standard_error = 0.1, .interval = {0.02, 0.3}, .determined = true},
                       {.standard_error = 0.01, .interval = {0.38, 0.42}, .determined = true}};
  report.covariance = Eigen::Matrix3d{{0.01, -0.005, 0}, {-0.005, 0.01, 0}, {0, 0, 0.0001}};
  const Vector x{{0.5, 0.1, 0.4}};
  const auto found = without_weights(unknowns, Reparametrization(unknowns), x, report);
  ASSERT_EQ(found.size(), 1);
  EXPECT_TRUE(found[0].x.isApprox(Vector{{0.55, 0, 0.4}}, 1e-9)) << found[0].x.transpose();
  ASSERT_EQ(found[0].absent.size(), 1);
  EXPECT_EQ(found[0].absent[0].component, 1);
  EXPECT_EQ(found[0].absent[0].confidence.interval[0], 0);
}

}  // namespace
}  // namespace selenite
