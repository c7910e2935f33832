// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/residual_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/objective/photo_weights.h"
#include "fit/synthetic_renderer.h"
#include "math/rng.h"

namespace selenite {
namespace {

constexpr int kSide = 64;

/// A bright ramp with a dark half: brightness from 0.05 to 2.
Photo ramp() {
  Photo photo = grey_capture(kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const float level = (y < kSide / 2 ? 0.05f : 1.f) * (1 + static_cast<float>(x) / kSide);
      photo.reference[static_cast<std::size_t>(y) * kSide + x] = Colorf(level);
    }
  check_photo(photo);
  return photo;
}

/// Independent normal numbers of a photo's size.
Eigen::VectorXf normal_numbers(std::uint64_t seed) {
  Eigen::VectorXf out(3 * kSide * kSide);
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const Random random(seed, static_cast<std::uint32_t>(i), 0);
    const double radius = std::sqrt(-2 * std::log(1 - random.uniform(0)));
    out[i] = static_cast<float>(radius * std::cos(2 * M_PI * random.uniform(1)));
  }
  return out;
}

PhotoResiduals residuals(const Photo& photo, const Eigen::VectorXf& error) {
  return {photo, Eigen::VectorXf::Constant(error.size(), 1e-8f), error.cwiseAbs2()};
}

ModelError found(const PhotoResiduals& one) { return ResidualModel(std::span(&one, 1)).error(); }

// A t distribution of normal residuals has a scale of about 0.9 of theirs.
TEST(ResidualModel, FindsEachPartOfTheErrorByItsPattern) {
  const Photo photo = ramp();
  const ErrorScales scales(photo);
  const Eigen::VectorXf normal = normal_numbers(1);
  const auto error_of = [&](const Eigen::VectorXf& squares, float size) -> Eigen::VectorXf {
    return size * normal.cwiseProduct(squares.cwiseSqrt());
  };
  const ModelError relative = found(residuals(photo, error_of(scales.relative, 0.2f)));
  EXPECT_NEAR(relative.relative, 0.2, 0.03);
  EXPECT_LT(relative.absolute, 0.02);
  const ModelError absolute = found(residuals(photo, error_of(scales.absolute, 0.1f)));
  EXPECT_NEAR(absolute.absolute, 0.1, 0.015);
  EXPECT_LT(absolute.relative, 0.05);
  const ModelError shift = found(residuals(photo, error_of(scales.shift, 0.7f)));
  EXPECT_NEAR(shift.shift, 0.7, 0.1);
  EXPECT_LT(shift.relative, 0.02);
}

TEST(ResidualModel, IsNothingWhereTheModelExplainsThePhotos) {
  const Photo photo = ramp();
  const Eigen::VectorXf none = Eigen::VectorXf::Zero(3 * kSide * kSide);
  const PhotoResiduals explained = residuals(photo, none);
  const ResidualModel model(std::span(&explained, 1));
  EXPECT_EQ(model.error().relative, 0);
  EXPECT_EQ(model.error().absolute, 0);
  EXPECT_EQ(model.error().shift, 0);
  // Then all weights are those of the noise, times the same factor.
  const Eigen::VectorXf precision = model.precision(explained);
  EXPECT_FLOAT_EQ(precision.minCoeff(), precision.maxCoeff());
}

// A twentieth of the pixels is off by a hundred times as much: a normal distribution would take the
// root mean square, 22 times too large, for the error of all.
TEST(ResidualModel, OutliersCountLittleAndLeaveTheRestAlone) {
  const Photo photo = ramp();
  const Eigen::VectorXf clean =
      0.1f * normal_numbers(2).cwiseProduct(ErrorScales(photo).relative.cwiseSqrt());
  Eigen::VectorXf dirty = clean;
  const auto is_outlier = [](int x, int y) { return x < 14 && y < 14; };
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (is_outlier(x, y)) dirty.segment<3>(3 * (y * kSide + x)) *= 100;
  const PhotoResiduals one = residuals(photo, dirty);
  const ResidualModel model(std::span(&one, 1));
  const double before = found(residuals(photo, clean)).relative;
  EXPECT_LT(model.error().relative, 2 * before);
  const Eigen::VectorXf precision = model.precision(one);
  EXPECT_LT(precision[3 * (7 * kSide + 7)], 0.05f * precision[3 * (7 * kSide + 40)]);
}

// Weights that follow a pixel's own noise would leave a fit darker than photos with bright specks.
TEST(ResidualModel, APixelsOwnResidualLeavesItsWeightAlone) {
  const Photo photo = ramp();
  Eigen::VectorXf error = 0.1f * normal_numbers(3);
  constexpr Eigen::Index kPixel = 20 * kSide + 30;
  const PhotoResiduals before = residuals(photo, error);
  const ResidualModel model(std::span(&before, 1));
  error.segment<3>(3 * kPixel).setConstant(5);
  const PhotoResiduals after = residuals(photo, error);
  EXPECT_FLOAT_EQ(model.precision(before)[3 * kPixel], model.precision(after)[3 * kPixel]);
  EXPECT_LT(model.precision(after)[3 * (kPixel + 1)], model.precision(before)[3 * (kPixel + 1)]);
}

TEST(PhotoWeights, OfALossThatIsNotWeightedStayAlike) {
  Scene scene = synthetic_scene();
  std::vector<Photo> photos{ramp()};
  const PhotoWeights weights(photos, false);
  EXPECT_FLOAT_EQ(weights[0].minCoeff(), weights[0].maxCoeff());
  EXPECT_NEAR(weights[0].sum(), 1, 1e-4);
  EXPECT_FLOAT_EQ(weights.of_loss(0).sum(), weights[0].sum());
}

}  // namespace
}  // namespace selenite
