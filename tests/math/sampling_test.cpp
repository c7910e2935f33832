// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/sampling.h"

#include <gtest/gtest.h>

#include <limits>

#include "math/rng.h"
#include "math/statistics.h"

namespace selenite {
namespace {

constexpr int kSamples = 200000;

template <class Draw>
void for_samples(Draw&& draw) {
  Random random(42, 0, 0);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    random.start_bounce(i);
    draw(random.uniform(0), random.uniform(1));
  }
}

/// Cell of a coordinate in [0, 1].
int cell(double x, int cells) { return std::clamp(static_cast<int>(x * cells), 0, cells - 1); }

/// Counts points whose two coordinates should be uniform in [0, 1]. False alarms: 1 in 32 000.
struct Grid {
  static constexpr int kCells = 24;
  std::vector<double> counts = std::vector<double>(kCells * kCells, 0);
  void add(double a, double b) { ++counts[cell(a, kCells) * kCells + cell(b, kCells)]; }
  double z() const {
    const std::vector<double> expected(counts.size(), double(kSamples) / (kCells * kCells));
    return chi_square_z(counts, expected);
  }
};

double turn(double x, double y) { return std::atan2(y, x) / (2 * kPi<double>)+0.5; }

TEST(SquareToDisc, CoversTheDiscEvenly) {
  Grid grid;
  for_samples([&](float u, float v) {
    const Vec2f d = square_to_disc(u, v);
    const double r2 = double(d.x) * d.x + double(d.y) * d.y;
    ASSERT_LE(r2, 1 + 1e-6);
    grid.add(r2, turn(d.x, d.y));
  });
  EXPECT_LT(std::abs(grid.z()), 4);
}

TEST(SquareToDisc, IsContinuousAndDefinedInTheCentreAndTheCorners) {
  const Vec2f centre = square_to_disc(0.5f, 0.5f);
  EXPECT_EQ(centre.x, 0);
  EXPECT_EQ(centre.y, 0);
  for (const float u : {0.0f, 1.0f})
    for (const float v : {0.0f, 1.0f}) {
      const Vec2f d = square_to_disc(u, v);
      EXPECT_NEAR(d.x * d.x + d.y * d.y, 1, 1e-6);
    }
  for_samples([&](float u, float v) {
    const Vec2f a = square_to_disc(u, v), b = square_to_disc(u + 1e-4f, v);
    ASSERT_LT(std::hypot(a.x - b.x, a.y - b.y), 4e-4);
  });
}

TEST(SquareToCosineHemisphere, HasDensityCosOverPi) {
  Grid grid;
  Tally height;
  for_samples([&](float u, float v) {
    const Vec3f d = square_to_cosine_hemisphere(u, v);
    ASSERT_GE(d.z, 0);
    ASSERT_NEAR(dot(d, d), 1, 1e-6);
    // Cumulative: P(cos < c) = c^2.
    grid.add(double(d.z) * d.z, turn(d.x, d.y));
    height.add(d.z);
  });
  EXPECT_LT(std::abs(grid.z()), 4);
  EXPECT_LT(std::abs(height.estimate().z(2.0 / 3)), 4);
}

class Cone : public testing::TestWithParam<double> {};

TEST_P(Cone, IsUniformInSolidAngle) {
  const double width = GetParam();  // 1 - cos
  Grid grid;
  Tally height;
  for_samples([&](float u, float v) {
    const Vec3f d = square_to_cone(u, v, static_cast<float>(width));
    ASSERT_NEAR(dot(d, d), 1, 2e-6);
    // 1 - cos from the sine in a narrow cone: keeps its digits.
    const double sine2 = double(d.x) * d.x + double(d.y) * d.y;
    const double gap = width < 0.5 ? sine2 / (1 + std::sqrt(1 - sine2)) : 1 - double(d.z);
    ASSERT_LE(gap, width * (1 + 1e-5));
    grid.add(gap / width, turn(d.x, d.y));
    height.add(gap);
  });
  EXPECT_LT(std::abs(grid.z()), 4);
  EXPECT_LT(std::abs(height.estimate().z(width / 2)), 4);
}
INSTANTIATE_TEST_SUITE_P(Widths, Cone, testing::Values(1e-10, 1e-5, 0.3, 1.0, 1.9));

TEST(PowerHeuristic, WeightsOfTwoStrategiesAddUpToOne) {
  for (const float a : {1e-30f, 1e-6f, 0.3f, 1.0f, 1e6f, 1e30f})
    for (const float b : {1e-30f, 1e-6f, 0.3f, 1.0f, 1e6f, 1e30f}) {
      const float wa = power_heuristic(a, b), wb = power_heuristic(b, a);
      ASSERT_TRUE(std::isfinite(wa));
      EXPECT_NEAR(wa + wb, 1, 1e-6) << a << " " << b;
    }
  EXPECT_NEAR(power_heuristic(2.0f, 1.0f), 0.8f, 1e-7);
}

TEST(PowerHeuristic, DecidesAtZeroAndInfinity) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(power_heuristic(0.0f, 0.0f), 0);
  EXPECT_EQ(power_heuristic(0.0f, 1.0f), 0);
  EXPECT_EQ(power_heuristic(1.0f, 0.0f), 1);
  EXPECT_EQ(power_heuristic(1.0f, kInfinity), 0);
  EXPECT_EQ(power_heuristic(kInfinity, 1.0f), 1);
}

}  // namespace
}  // namespace selenite
