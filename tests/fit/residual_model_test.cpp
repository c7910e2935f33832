// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/residual_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "fit/objective/photo_weights.h"
#include "fit/synthetic_renderer.h"
#include "math/rng.h"
#include "math/scalar.h"

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
    out[i] = static_cast<float>(radius * std::cos(2 * kPi<double> * random.uniform(1)));
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

TEST(ResidualModel, AShiftOfMoreThanAPixelIsNoMisalignment) {
  const Photo photo = ramp();
  const Eigen::VectorXf far =
      3 * normal_numbers(1).cwiseProduct(ErrorScales(photo).shift.cwiseSqrt());
  EXPECT_NEAR(found(residuals(photo, far)).shift, 1, 1e-6);
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
  const Eigen::VectorXf precision = model.precision(explained, 0);
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
  const Eigen::VectorXf precision = model.precision(one, 0);
  EXPECT_LT(precision[3 * (7 * kSide + 7)], 0.05f * precision[3 * (7 * kSide + 40)]);
}

// As whoever stands in the light changes all pixels of a photo, these are one outlier, not many.
TEST(ResidualModel, APhotoThreeTimesAsWrongCountsANinth) {
  const Photo photo = ramp();
  const Eigen::VectorXf root = ErrorScales(photo).relative.cwiseSqrt();
  std::vector<PhotoResiduals> all;
  for (const std::uint64_t seed : {4, 5, 6, 7})
    all.push_back(
        residuals(photo, (seed == 7 ? 0.3f : 0.1f) * normal_numbers(seed).cwiseProduct(root)));
  const ResidualModel model(all);
  const float share = model.precision(all[3], 3).sum() / model.precision(all[0], 0).sum();
  EXPECT_NEAR(share, 1. / 9, 0.04);
  // What all have in common is the model's error and no photo's own.
  EXPECT_NEAR(model.precision(all[1], 1).sum() / model.precision(all[0], 0).sum(), 1, 0.1);
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
  EXPECT_FLOAT_EQ(model.precision(before, 0)[3 * kPixel], model.precision(after, 0)[3 * kPixel]);
  EXPECT_LT(model.precision(after, 0)[3 * (kPixel + 1)],
            model.precision(before, 0)[3 * (kPixel + 1)]);
}

TEST(ErrorScales, AnEdgeHasItsSlopeInEveryDirectionAndABrightPixelNone) {
  const auto shift_at = [](const std::function<bool(int, int)>& bright, int x, int y) {
    Photo photo = grey_capture(kSide);
    for (int i = 0; i < kSide * kSide; ++i)
      photo.reference[static_cast<std::size_t>(i)] =
          Colorf(bright(i % kSide, i / kSide) ? 3.f : 1.f);
    check_photo(photo);
    return ErrorScales(photo).shift[3 * (y * kSide + x)];
  };
  EXPECT_FLOAT_EQ(shift_at([](int x, int) { return x < 30; }, 30, 20), 1);
  EXPECT_FLOAT_EQ(shift_at([](int, int y) { return y < 20; }, 30, 20), 1);
  EXPECT_FLOAT_EQ(shift_at([](int x, int y) { return x + y < 50; }, 30, 20), 2);
  EXPECT_FLOAT_EQ(shift_at([](int x, int y) { return x - y < 10; }, 30, 20), 2);
  for (int x = 28; x < 33; ++x)
    for (int y = 18; y < 23; ++y) {
      EXPECT_EQ(shift_at([](int p, int q) { return p == 30 && q == 20; }, x, y), 0);
      EXPECT_EQ(shift_at([](int p, int q) { return p / 2 == 15 && q / 2 == 10; }, x, y), 0);
    }
}

/// An even photo of 90 pixels with rare bright ones, brought to 64: each of those lies in several pixels.
Photo with_spread_fireflies(std::uint64_t seed) {
  constexpr int kLarge = 90;
  Photo photo = grey_capture(kLarge);
  for (std::size_t i = 0; i < photo.size(); ++i) {
    const Random random(seed, static_cast<std::uint32_t>(i), 0);
    photo.reference[i] = Colorf(random.uniform(0) < 0.03 ? 10.3f : 0.3f);  // 0.6 in the mean
  }
  check_photo(photo);
  Photo small = photo.resized(kSide);
  small.is_small = false;  // as if it were read at that size
  check_photo(small);
  return small;
}

/// By which factor weights of this photo, once its residuals are learned, make an even render of 0.6 of it.
double weighted_brightness(const Photo& photo) {
  Eigen::VectorXf shown(3 * kSide * kSide);
  for (std::size_t i = 0; i < photo.size(); ++i)
    shown.segment<3>(static_cast<Eigen::Index>(3 * i)).setConstant(photo.reference[i][0]);
  const PhotoResiduals learned = residuals(photo, shown.array() - 0.6f);
  const Eigen::VectorXf weights = ResidualModel(std::span(&learned, 1)).precision(learned, 0);
  return static_cast<double>(weights.dot(shown)) / static_cast<double>(weights.sum()) / 0.6;
}

// Else a fit finds the median of such a photo: two thirds of its light, and is sure of it.
TEST(ResidualModel, BrightPixelsThatAFilterHasSpreadLeaveTheirWeightsAlone) {
  double sum = 0;
  constexpr int kPhotos = 20;
  for (std::uint64_t seed = 1; seed <= kPhotos; ++seed)
    sum += weighted_brightness(with_spread_fireflies(seed));
  EXPECT_NEAR(sum / kPhotos, 1, 0.03);
}

/// Renders of the ramp with `noise` of a sample and the error `relative(pixel)`, `iterations` of them.
void learn(PhotoWeights& weights, const Photo& photo, int iterations, double noise,
           const std::function<double(std::size_t)>& relative) {
  RenderSettings settings;
  settings.width = settings.height = kSide;
  settings.spp = 8;
  for (int n = 1; n <= iterations; ++n) {
    settings.seed = static_cast<std::uint64_t>(n);
    Film film = evenly_noisy_film(SlotLayout(), settings, noise,
                                  [](std::size_t) { return std::pair(0., 0.); });
    for (std::size_t i = 0; i < film.size(); ++i) {
      const Colorf value = photo.reference[i] * static_cast<float>(1 + relative(i));
      film.mean[i] += value;
      film.half_a[i] += value;
    }
    const Observation seen{0, std::move(film), {}};
    weights.learn(std::span(&seen, 1), 0.9, n);
  }
}

// Where the model explains the photos, weights are those of the noise: bit by bit.
TEST(PhotoWeights, AreThoseOfTheNoiseWhereTheModelExplainsThePhotos) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  learn(weights, photos[0], 14, 0.2, [](std::size_t) { return 0; });
  weights.weigh_answer();
  EXPECT_EQ(weights.model_error().relative, 0);
  const Eigen::VectorXf noise =
      noise_weights(photos[0], 1, Eigen::VectorXf::Constant(weights[0].size(), square(0.2f)));
  EXPECT_LT((weights[0] - noise).cwiseQuotient(noise).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(PhotoWeights, KnowAModelErrorThatNeighboursShareAtTheAnswerOnly) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  const auto waves = [](std::size_t i) {
    const double x = static_cast<double>(i % kSide), y = static_cast<double>(i / kSide);
    return 0.14 * std::sin(0.4 * x) * std::cos(0.3 * y) * std::sqrt(2.0);
  };
  learn(weights, photos[0], 14, 0.02, waves);
  EXPECT_EQ(weights.model_error().relative, 0) << "values may be on their way";
  const Eigen::VectorXf before = weights[0];
  weights.weigh_answer();
  EXPECT_NEAR(weights.model_error().relative, 0.1, 0.05);
  EXPECT_LT(weights[0].sum(), 0.6f * before.sum());
}

// What the values were off by before is in the sums, and not in the last residuals.
TEST(PhotoWeights, ResidualsOnTheWayToTheAnswerAreNoModelError) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  learn(weights, photos[0], 13, 0.02,
        [](std::size_t i) { return 0.1 * std::sin(0.4 * static_cast<double>(i % kSide)); });
  learn(weights, photos[0], 1, 0.02, [](std::size_t) { return 0; });
  weights.weigh_answer();
  EXPECT_EQ(weights.model_error().relative, 0);
}

TEST(PhotoWeights, APlainModelErrorJoinsAtOnce) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  learn(weights, photos[0], 3, 0.02, [](std::size_t) { return 0.5; });
  EXPECT_GT(weights.model_error().relative, 0.2);
}

// Half a render and the other half share no noise, however strong it is.
TEST(PhotoWeights, NoiseOfRendersIsNoModelError) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  learn(weights, photos[0], 3, 1, [](std::size_t) { return 0; });
  EXPECT_EQ(weights.version(), 1);
  EXPECT_EQ(weights.model_error().relative, 0);
}

TEST(PhotoWeights, AreLearnedEverLessOftenAndLeaveLossesTheirUnit) {
  const std::vector<Photo> photos{ramp()};
  PhotoWeights weights(photos);
  const Eigen::VectorXf squares = brightness(photos[0]).cwiseAbs2();
  EXPECT_NEAR(weights.of_loss(0).dot(squares), 1, 1e-3);
  learn(weights, photos[0], 14, 0.2, [](std::size_t) { return 0; });
  EXPECT_EQ(weights.version(), 3) << "at 3, 6 and 12";
  EXPECT_NEAR(weights.of_loss(0).dot(squares), 1, 1e-3);
}

// Of n pixels whose channels vary together, by hand.
TEST(PhotoWeights, TellTheNoiseOfALoss) {
  const std::vector<Photo> photos{ramp()};
  const PhotoWeights weights(photos, false);
  constexpr double kResidual = 0.3, kVariance = 0.04;
  constexpr Eigen::Index kPixels = kSide * kSide;
  Halves halves;
  halves.residual_a = halves.residual_b = Eigen::VectorXf::Constant(3 * kPixels, kResidual);
  halves.variance = Eigen::VectorXf::Constant(3 * kPixels, kVariance);
  const Observation seen{0, {}, {}};
  const NoisyLoss loss = weights.loss(std::span(&seen, 1), {halves});
  EXPECT_NEAR(loss.value, square(kResidual), 1e-6);
  const double of_pixel = 2 * square(kResidual) * kVariance + square(kVariance);
  EXPECT_NEAR(loss.variance, of_pixel / kPixels, 1e-3 * of_pixel / kPixels);
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
