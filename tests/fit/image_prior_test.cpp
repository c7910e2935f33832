// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/image_prior.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/image_scenes.h"
#include "fit/run/fit.h"
#include "fit/taken_photos.h"

namespace selenite {
namespace {

constexpr int kSide = 16;

Texture image(bool encoded) {
  return {"Wood",
          2,
          1,
          std::vector<Colorf>(2, Colorf(0.5f)),
          {},
          encoded,
          Extension::kExtend,
          Interpolation::kLinear};
}

std::vector<double> gradient_of(const Vector& values, const PriorScale& scale, bool encoded = false,
                                const Vector& moving = Vector::Ones(6)) {
  std::vector<double> gradient(6);
  add_image_prior(image(encoded), Vector::Constant(6, 0.5), values, moving, scale, gradient);
  return gradient;
}

/// By hand: d/dv of L / N times (v - m)^2 / (0.2 m)^2, m = 0.6 the image's mean.
TEST(ImagePrior, PullsTexelsToTheImagesColourAsStronglyAsTheMisfitSays) {
  Vector values(6);
  values << 0.5, 0.6, 0.6, 0.7, 0.6, 0.6;
  const std::vector<double> found = gradient_of(values, {0.09, 900});
  const double by_hand = 2 * 0.09 / 900 * 0.1 / (0.12 * 0.12);
  EXPECT_NEAR(found[0], -by_hand, 1e-12);
  EXPECT_NEAR(found[3], by_hand, 1e-12);
  for (const std::size_t i : {1u, 2u, 4u, 5u}) EXPECT_EQ(found[i], 0) << "one colour costs nothing";
  EXPECT_NEAR(gradient_of(values, {0.09, 900}, true)[3], 2.2 * 2.2 * by_hand, 1e-12);
  EXPECT_NEAR(gradient_of(values, {0.09, 3})[3], 300 * by_hand / 2, 1e-12)
      << "half a pixel a texel";
  EXPECT_EQ(gradient_of(values, {0, 900})[3], 0) << "where photos are explained";
  Vector moving = Vector::Ones(6);
  moving[3] = 0;
  EXPECT_EQ(gradient_of(values, {0.09, 900}, false, moving)[3], 0) << "what no photo shows stays";
}

/// A board of a texel a pixel, whose texels are 0.5 but for a pattern.
Scene fine_board(float pattern) {
  Scene scene = board({0.5f, 0.5f, 0.5f, 0.5f});
  std::vector<Colorf> pixels;
  for (int i = 0; i < kSide * kSide; ++i)
    pixels.emplace_back(0.5f + ((i / 2 % 2) == (i / kSide / 2 % 2) ? pattern : -pattern));
  scene.appearance.materials[0].maps[0].texture =
      std::make_shared<Texture>("Wood", kSide, kSide, std::move(pixels), std::vector<float>(),
                                false, Extension::kExtend, Interpolation::kLinear);
  return scene;
}

/// Of photos that show the pattern at these sizes.
FitResult fitted(float first, float second, const std::string& prior = "agreement",
                 int iterations = 60) {
  std::vector<Photo> photos = taken_photos(fine_board(first), kSide);
  photos.push_back(taken_photos(fine_board(second), kSide)[0]);
  photos[1].id = "Second";
  FitSettings settings;
  settings.iterations = iterations;
  settings.spp = 8;
  settings.tolerance = 0;
  settings.threads = 1;
  settings.prior = prior;
  Fit fit(fine_board(0), photos, {texels()}, settings);
  while (fit.step()) {
  }
  EXPECT_EQ(fit.result().stopped, StopReason::kIterations) << fit.result().message;
  return fit.result();
}

/// Size of the pattern that a fit has found.
double pattern_of(const FitResult& result) {
  const Vector& values = result.fields_best->front();
  double sum = 0;
  for (Eigen::Index i = 0; i < kSide * kSide; ++i)
    sum += (values[3 * i] - 0.5) * ((i / 2 % 2) == (i / kSide / 2 % 2) ? 1 : -1);
  return sum / (kSide * kSide);
}

/// Least squares would find the same pattern both times, the mean of the photos.
TEST(ImagePrior, APatternThatPhotosContradictIsFoundInPart) {
  const FitResult same = fitted(0.1f, 0.1f), other = fitted(0.2f, 0);
  const double agreed = pattern_of(same), contradicted = pattern_of(other);
  EXPECT_GT(agreed, 0.06);
  EXPECT_LT(contradicted, 0.85 * agreed);
  EXPECT_GT(contradicted, 0.3 * agreed);
  EXPECT_GT(same.patterns[0].explained, 0.9);
  EXPECT_LT(other.patterns[0].explained, 0.7);
}

/// The residuals are the pattern of both photos: they say nothing against it. By all of the misfit it is held back
/// until it is found.
TEST(ImagePrior, WhatPhotosAgreeOnHoldsBackNoPattern) {
  const auto found = [](const std::string& prior, int iterations) {
    return pattern_of(fitted(0.1f, 0.1f, prior, iterations));
  };
  EXPECT_GT(found("agreement", 2), 1.5 * found("misfit", 2));
  EXPECT_GT(found("agreement", 60), 0.99 * found("misfit", 60));
}

}  // namespace
}  // namespace selenite
