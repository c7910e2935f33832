// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/medium.h"

#include <gtest/gtest.h>

#include "math/rng.h"
#include "math/statistics.h"

namespace selenite {
namespace {

class HenyeyGreenstein : public testing::TestWithParam<double> {};

/// The share of directions with a deflection cosine below `c`: the integral of the density.
double cumulative(double g, double c) {
  if (std::abs(g) < 1e-9) return (1 + c) / 2;
  return (1 - g * g) / (2 * g) * (1 / std::sqrt(1 + g * g - 2 * g * c) - 1 / (1 + g));
}

TEST_P(HenyeyGreenstein, DensityIsTheSlopeOfItsDistribution) {
  const double g = GetParam();
  EXPECT_NEAR(cumulative(g, 1), 1, 1e-9);
  for (double c = -0.95; c < 1; c += 0.1) {
    const double h = 1e-4;
    const double slope = (cumulative(g, c + h) - cumulative(g, c - h)) / (2 * h);
    EXPECT_NEAR(henyey_greenstein(g, c) * 2 * kPi<double>, slope, 1e-6 * slope + 1e-6) << c;
  }
}

TEST_P(HenyeyGreenstein, SamplesInvertTheDistribution) {
  const double g = GetParam();
  for (int i = 0; i <= 1000; ++i) {
    const double u = std::min(i / 1000.0, 1 - 0x1p-24);
    const double exact = sample_henyey_greenstein(g, u);
    ASSERT_LE(std::abs(exact), 1);
    EXPECT_NEAR(cumulative(g, exact), u, 1e-8) << u;
    const float drawn = sample_henyey_greenstein(static_cast<float>(g), static_cast<float>(u));
    ASSERT_LE(std::abs(drawn), 1);
    // Floats next to 1 are 3.5e-4 apart as angles.
    if (i < 1000) EXPECT_NEAR(std::acos(static_cast<double>(drawn)), std::acos(exact), 1e-3) << u;
  }
}

TEST_P(HenyeyGreenstein, MeanCosineIsG) {
  const double g = GetParam();
  Tally cosine, second;
  for (int i = 0; i < 100000; ++i) {
    const Random random(7, 0, i);
    const double c = sample_henyey_greenstein(static_cast<float>(g), random.uniform(0));
    cosine.add(c);
    second.add(1.5 * c * c - 0.5);
  }
  // Legendre's moments of this phase function are the powers of g; 4 errors: 1 in 16 000.
  EXPECT_NEAR(cosine.mean(), g, 4 * cosine.estimate().error + 1e-6);
  EXPECT_NEAR(second.mean(), g * g, 4 * second.estimate().error + 1e-6);
}

TEST_P(HenyeyGreenstein, SlopeAgreesWithDifferences) {
  using D = Dual<double, 1>;
  const double g = GetParam();
  const double h = 1e-6 * (1 - std::abs(g) + 0.1);
  for (double c : {-1.0, -0.5, 0.0, 0.9, 1.0}) {
    const D value = henyey_greenstein(D::variable(g, 0), c);
    const double want = (henyey_greenstein(g + h, c) - henyey_greenstein(g - h, c)) / (2 * h);
    EXPECT_NEAR(value.d[0], want, 1e-4 * std::abs(want) + 1e-6) << c;
  }
}

INSTANTIATE_TEST_SUITE_P(Anisotropies, HenyeyGreenstein,
                         testing::Values(-0.999, -0.99, -0.5, -0.051, -0.049, -1e-3, -1e-5, 0.0,
                                         1e-5, 0.9e-3, 1.1e-3, 0.049, 0.051, 0.5, 0.99, 0.999));

TEST(HenyeyGreenstein, NothingJumpsWhereTheFormulaChanges) {
  for (double u : {0.0, 0.1, 0.5, 0.9, 0.999}) {
    for (double g : {-0.05, 0.05}) {
      const double below = sample_henyey_greenstein(g * (1 - 1e-9), u);
      const double above = sample_henyey_greenstein(g * (1 + 1e-9), u);
      EXPECT_NEAR(below, above, 1e-8);
    }
  }
}

}  // namespace
}  // namespace selenite
