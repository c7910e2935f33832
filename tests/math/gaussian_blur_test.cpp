// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/gaussian_blur.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace selenite {
namespace {

constexpr std::ptrdiff_t kSide = 41, kMiddle = 20;

std::size_t at(std::ptrdiff_t y, std::ptrdiff_t x, int c) {
  return static_cast<std::size_t>(3 * (kSide * y + x) + c);
}

std::vector<double> impulse(std::ptrdiff_t y, std::ptrdiff_t x, int c) {
  std::vector<double> picture(3 * kSide * kSide);
  picture[at(y, x, c)] = 1;
  return picture;
}

class Smoothed : public testing::TestWithParam<double> {};

TEST_P(Smoothed, SpreadsAPixelAsAGaussianOfItsOwnChannel) {
  const double sigma = GetParam();
  const auto found = gaussian_blur(impulse(kMiddle, kMiddle, 1), kSide, kSide, 3, sigma, false);
  double sum = 0, vertical = 0, horizontal = 0;
  for (std::ptrdiff_t y = 0; y < kSide; ++y)
    for (std::ptrdiff_t x = 0; x < kSide; ++x) {
      const double value = found[at(y, x, 1)];
      sum += value;
      vertical += value * std::pow(y - kMiddle, 2);
      horizontal += value * std::pow(x - kMiddle, 2);
      EXPECT_EQ(found[at(y, x, 0)], 0);
      EXPECT_EQ(found[at(y, x, 2)], 0);
    }
  EXPECT_NEAR(sum, 1, 1e-12);
  // Cut at three sigma, which takes 3 % of the variance; of a narrow one pixels are coarse samples.
  EXPECT_NEAR(vertical, sigma * sigma, 0.04 * sigma * sigma);
  EXPECT_NEAR(horizontal, vertical, 1e-12);
}
INSTANTIATE_TEST_SUITE_P(Sigma, Smoothed, testing::Values(0.7, 1.5, 4.0));

TEST(Smoothed, GoesOnAtTheOtherEndOnlyWhereThePictureRepeats) {
  for (const bool repeats : {false, true}) {
    const auto found = gaussian_blur(impulse(0, kMiddle, 0), kSide, kSide, 3, 1, repeats);
    EXPECT_EQ(found[at(kSide - 1, kMiddle, 0)] > 0, repeats);
    EXPECT_EQ(found[at(kSide - 1, kMiddle, 0)], repeats ? found[at(1, kMiddle, 0)] : 0);
    // What is alike everywhere stays, at the edges too.
    for (const double value :
         gaussian_blur(std::vector<double>(3 * kSide * kSide, 0.25), kSide, kSide, 3, 2, repeats))
      EXPECT_NEAR(value, 0.25, 1e-12);
  }
}

TEST(Smoothed, ReachesFartherThanThePicture) {
  const std::vector<double> small = {0, 1, 2, 3};
  for (const double value : gaussian_blur(small, 2, 2, 1, 20, true)) EXPECT_NEAR(value, 1.5, 0.02);
}

TEST(Smoothed, LeavesAllAsItIsWhereNothingIsToBeSmoothed) {
  const auto picture = impulse(3, 4, 2);
  EXPECT_EQ(gaussian_blur(picture, kSide, kSide, 3, 0, true), picture);
}

}  // namespace
}  // namespace selenite
