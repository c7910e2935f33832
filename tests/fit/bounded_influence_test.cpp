// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/bounded_influence.h"

#include <gtest/gtest.h>

namespace selenite {
namespace {

constexpr int kColumns = 9, kRows = 7, kMiddle = 3 * kColumns + 4;

/// From 1 to 2, and one cell of chance.
Eigen::ArrayXf strengths() {
  Eigen::ArrayXf all = Eigen::ArrayXf::LinSpaced(kColumns * kRows, 1, 2);
  all[kMiddle] = 1000;
  return all;
}

TEST(BoundedInfluence, ACellCountsByNoMoreThanItsNeighbours) {
  const Eigen::ArrayXf bounded = strengths() * bounded_influence(strengths(), kColumns);
  EXPECT_LE(bounded.maxCoeff(), 1);
  EXPECT_NEAR(bounded[kMiddle], 0.75f, 0.01f) << "half of the median around it";
  EXPECT_NEAR(bounded[kMiddle + 1], 0.75f, 0.02f) << "beside it";
}

TEST(BoundedInfluence, WhatIsWeakerThanItsNeighboursCountsWhole) {
  Eigen::ArrayXf strength = strengths();
  strength[kMiddle] = 0.1f;
  const Eigen::ArrayXf factors = bounded_influence(strength, kColumns);
  EXPECT_EQ(factors[kMiddle], 1);
  EXPECT_LE(factors.maxCoeff(), 1);
  EXPECT_GT(factors.minCoeff(), 0.4f);
}

TEST(BoundedInfluence, CellsWithoutDerivativesAreNoNeighbours) {
  Eigen::ArrayXf strength = Eigen::ArrayXf::Zero(kColumns * kRows);
  strength[kMiddle] = 3;
  const Eigen::ArrayXf factors = bounded_influence(strength, kColumns);
  EXPECT_FLOAT_EQ(factors[kMiddle], 0.5f);
  EXPECT_EQ(factors[0], 1);
}

}  // namespace
}  // namespace selenite
