// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/asked_precision.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

/// Of a determined component, +-`half` around x.
Confidence known(double x, double half) {
  Confidence one;
  one.interval = {x - half, x + half};
  one.determined = true;
  return one;
}

double factor(const UnknownParameter& unknown, const Confidence& one, double x, double share) {
  const Unknowns unknowns(synthetic_scene(), {unknown});
  return samples_factors(unknowns, Vector::Constant(1, x), {one}, share)[0];
}

const UnknownParameter kRoughness{"Body", "roughness", {0.5}, 0.2, 0.7, 0.03};

TEST(AskedPrecision, GrowsWithTheSquareOfTheInterval) {
  EXPECT_NEAR(factor(kRoughness, known(0.2, 0.005), 0.2, 0.01), 1, 1e-9) << "1 % of the bounds";
  EXPECT_NEAR(factor(kRoughness, known(0.2, 0.01), 0.2, 0.01), 4, 1e-9);
  EXPECT_NEAR(factor(kRoughness, known(0.6, 0.012), 0.6, 0.01), 1, 1e-9) << "2 % of the value";
}

TEST(AskedPrecision, OfALogarithmicValueGoesByTheValueAlone) {
  const UnknownParameter extinction{"Body", "extinction", {1, 1, 1}, 0.01, 1000, 0.03};
  const Unknowns unknowns(synthetic_scene(), {extinction});
  const std::vector<Confidence> components(3, known(2, 0.08));
  const Vector factors = samples_factors(unknowns, Vector::Constant(3, 2), components, 0.01);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(factors[k], 4, 1e-9);
}

TEST(AskedPrecision, WantsNothingOfWhatSamplesDoNotDetermine) {
  Confidence open = known(0.5, 0.2);
  open.determined = false;
  EXPECT_EQ(factor(kRoughness, open, 0.5, 0.01), 0);
}

// What photos differ by stays: 1/4 of the variance, 3/4 are noise of samples.
TEST(AskedPrecision, SamplesNarrowTheNoiseAlone) {
  Confidence one = known(0.2, 0.0075);
  one.lasting = 0.25;
  const double squared = 1.5 * 1.5;
  const double left = 1 - 0.25 * squared;
  EXPECT_NEAR(factor(kRoughness, one, 0.2, 0.01), 0.75 * squared / left, 1e-9);
  one.interval = {0.195, 0.205};
  EXPECT_NEAR(factor(kRoughness, one, 0.2, 0.01), 1, 1e-9) << "as narrow as asked";
  one.interval = {0.189, 0.211};
  EXPECT_TRUE(std::isinf(factor(kRoughness, one, 0.2, 0.01))) << "half of it lasts";
}

// Few samples may have led it there: the interval says how far from it the truth may lie.
TEST(AskedPrecision, AnAnswerAtItsBoundIsAskedForToo) {
  Confidence at_bound = known(0.22, 0.02);
  at_bound.at_bound = AtBound::kMinimum;
  EXPECT_NEAR(factor(kRoughness, at_bound, 0.2, 0.01), 16, 1e-9);
}

}  // namespace
}  // namespace selenite
