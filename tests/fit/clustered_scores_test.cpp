// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/clustered_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fit/photo/photo.h"
#include "math/rng.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr int kSide = 40;

double normal_number(std::uint64_t seed, std::uint32_t index) {
  const Random random(seed, index, 0);
  return std::sqrt(-2 * std::log(1 - random.uniform(0))) *
         std::cos(2 * kPi<double> * random.uniform(1));
}

/// The mean of all numbers of some photos is unknown: each pixel's score is its number, and each has
/// the normal matrix 1. `number(photo, x, y)`; returns the factor on the error of independent pixels.
template <class Number>
double widening(int photos, const Number& number) {
  ClusteredScores scores(1, {});
  double gradient = 0, squares = 0;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Ones(1, 1);
  for (int p = 0; p < photos; ++p) {
    scores.begin_photo(photo_of_size("Front", kSide, kSide));
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const double value = number(p, x, y);
        gradient += value;
        squares += value * value;
        scores.add(static_cast<std::size_t>(y) * kSide + x, Vector::Constant(1, value), one);
      }
  }
  const double count = photos * kSide * kSide;
  const Vector step = Vector::Constant(1, -gradient / count);
  const Vector variance = Vector::Constant(1, squares / (count * count));
  return scores.widening({0}, one / count, step, variance)[0];
}

double of_pixel(std::uint64_t seed, int p, int x, int y) {
  return normal_number(seed, static_cast<std::uint32_t>((p * kSide + y) * kSide + x));
}

// Of 40 draws for each count of photos: chance exceeds the bounds in fewer than one of fifty.
TEST(ClusteredScores, IndependentPixelsAreLeftAlone) {
  for (const int photos : {1, 3, 13}) {
    int widened = 0;
    for (std::uint64_t seed = 0; seed < 40; ++seed)
      widened += widening(photos, [&](int p, int x, int y) { return of_pixel(seed, p, x, y); }) > 1;
    EXPECT_LE(widened, 3) << photos;
  }
}

// Squares of 4 x 4 pixels, the size of a block, share a number: 16 times as few are independent.
TEST(ClusteredScores, ErrorsThatNeighboursShareCountByTheirNumber) {
  const double found = widening(1, [&](int, int x, int y) { return of_pixel(5, 0, x / 4, y / 4); });
  EXPECT_NEAR(found, 4, 0.6);
}

// All pixels of a photo share most of their error: the photos are what counts.
TEST(ClusteredScores, ErrorsThatAPhotoSharesCountByPhotos) {
  constexpr int kPhotos = 13;
  std::vector<double> shared;
  double mean = 0, variance = 0;
  for (int p = 0; p < kPhotos; ++p) shared.push_back(normal_number(9, static_cast<unsigned>(p)));
  for (const double one : shared) mean += one / kPhotos;
  for (const double one : shared) variance += (one - mean) * (one - mean) / (kPhotos - 1);
  double squares = 0;
  const double found = widening(kPhotos, [&](int p, int x, int y) {
    const double value = shared[static_cast<std::size_t>(p)] + 0.1 * of_pixel(7, p, x, y);
    squares += value * value;
    return value;
  });
  const double count = kPhotos * kSide * kSide;
  const double by_photos = std::sqrt(variance / kPhotos) * 1.7823 / 1.6449;  // t, 12 degrees
  EXPECT_NEAR(found * std::sqrt(squares) / count, by_photos, 0.03 * by_photos);
}

// Four photos want 0, 1, -1 and 2, and the first counts six times as much as each of the others: their
// mean is 2 / 9. Without a photo it is 0.667, 0.125, 0.375, 0, as the means of the others are.
TEST(ClusteredScores, APhotoThatRulesIsJudgedByTheOthers) {
  const std::vector<double> wants{0, 1, -1, 2}, counts{6, 1, 1, 1};
  const std::vector<double> without{2. / 3, 1. / 8, 3. / 8, 0};
  ClusteredScores scores(1, {});
  const double answer = 2. / 9;
  for (std::size_t p = 0; p < wants.size(); ++p) {
    scores.begin_photo(photo_of_size("Front", 1, 1));
    scores.add(0, Vector::Constant(1, counts[p] * (answer - wants[p])),
               Eigen::MatrixXd::Constant(1, 1, counts[p]));
  }
  double mean = 0, squares = 0;
  for (const double one : without) mean += one / 4;
  for (const double one : without) squares += (one - mean) * (one - mean);
  const double error = 0.01;
  const double found = scores.widening({0}, Eigen::MatrixXd::Constant(1, 1, 1. / 9),
                                       Vector::Zero(1), Vector::Constant(1, error * error))[0];
  EXPECT_NEAR(found * error, std::sqrt(squares * 3 / 4) * 2.3534 / 1.6449, 1e-3);
}

// Tables of the two distributions.
TEST(ClusteredScores, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(student_quantile_95(2), 2.9200, 1e-4);
  EXPECT_NEAR(student_quantile_95(10), 1.8125, 2e-3);
  EXPECT_NEAR(student_quantile_95(30), 1.6973, 1e-3);
  EXPECT_NEAR(chi_square_ratio_99(2), 9.210 / 2, 1e-3);
  EXPECT_NEAR(chi_square_ratio_99(10), 23.209 / 10, 0.02);
  EXPECT_NEAR(chi_square_ratio_99(30), 50.892 / 30, 0.01);
}

}  // namespace
}  // namespace selenite
