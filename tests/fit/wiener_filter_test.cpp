// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/wiener_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/problem/pixel_weights.h"
#include "math/rng.h"

namespace selenite {
namespace {

constexpr int kSize = 64, kSpot = 40;
constexpr Eigen::Index kRows = 3 * kSize * kSize;
const Eigen::VectorXf kEqual = Eigen::VectorXf::Ones(kRows);

/// A wide wave in all channels and a spot of three by three pixels.
Eigen::VectorXf signal() {
  Eigen::VectorXf picture(kRows);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      picture.segment<3>(3 * (y * kSize + x)).setConstant(std::sin(0.1f * static_cast<float>(x)));
  for (int y = kSpot - 1; y <= kSpot + 1; ++y)
    picture.segment<9>(3 * (y * kSize + kSpot - 1)).setConstant(15);
  return picture;
}

/// Uniform, standard deviation 2.
Eigen::VectorXf noise(std::uint64_t seed) {
  Eigen::VectorXf picture(kRows);
  for (Eigen::Index i = 0; i < kRows; ++i)
    picture[i] =
        6.928f *
        (static_cast<float>(Random(seed, static_cast<std::uint32_t>(i), 0).uniform(0)) - 0.5f);
  return picture;
}

/// What an instrument is worth: share of the samples that are not thrown away.
double efficiency(const Eigen::VectorXf& instrument, const Eigen::VectorXf& truth) {
  const double both = instrument.cast<double>().dot(truth.cast<double>());
  return both * both / (instrument.squaredNorm() * truth.squaredNorm());
}

TEST(WienerFilter, KeepASpotSharpAndAverageTheRest) {
  const Eigen::VectorXf truth = signal(), a = truth + noise(1), b = truth + noise(2);
  const WienerFilter gains(a, b, kEqual, kSize, kSize);
  const Eigen::VectorXf found = gains.filter(a, 1);
  EXPECT_GT(found[3 * (kSpot * kSize + kSpot)], 9) << "of 15";
  const auto corner = [](const Eigen::VectorXf& x) { return x.head(3 * 20 * kSize); };
  EXPECT_LT((corner(found) - corner(truth)).norm(), 0.35 * corner(noise(1)).norm());
  EXPECT_GT(efficiency(found, truth), 0.85);
  EXPECT_LT(efficiency(a, truth), 0.35);
  EXPECT_LT(efficiency(box_blur(a, kSize, kSize, 1), truth), 0.6);
}

TEST(WienerFilter, LeaveWhatHasNoNoise) {
  const Eigen::VectorXf truth = signal();
  const Eigen::VectorXf found = WienerFilter(truth, truth, kEqual, kSize, kSize).filter(truth, 0);
  EXPECT_LT((found - truth).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(WienerFilter, LeaveNothingOfNoise) {
  const Eigen::VectorXf a = noise(1), b = noise(2);
  const Eigen::VectorXf found = WienerFilter(a, b, kEqual, kSize, kSize).filter(a, 1);
  EXPECT_LT(found.norm(), 0.1 * a.norm());
}

TEST(WienerFilter, AreFiniteWhereNothingCounts) {
  const Eigen::VectorXf none = Eigen::VectorXf::Zero(kRows), a = noise(1);
  EXPECT_EQ(WienerFilter(a, a, none, kSize, kSize).filter(a, 1), none);
  EXPECT_EQ(WienerFilter(none, none, kEqual, kSize, kSize).filter(a, 1), none);
}

}  // namespace
}  // namespace selenite
