// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/recursive_least_squares.h"

#include <gtest/gtest.h>

namespace selenite {
namespace {

/// Of one unknown: a slope of 1, a residual, and the variance of their product.
Measurement measured(double residual, double variance) {
  Measurement one(1);
  one.normal(0, 0) = one.strength[0] = 1;
  one.gradient[0] = residual;
  one.covariance(0, 0) = variance;
  return one;
}

// The equations of one iteration are n (u - x) = -g; sums of them are solved by hand.
TEST(RecursiveLeastSquares, EquationsHoldWhereverTheyWereMade) {
  RecursiveLeastSquares sums(1);
  sums.join(measured(-0.5, 0), Vector::Constant(1, 0.5), 1);
  sums.join(measured(2, 0), Vector::Constant(1, 3), 1);
  EXPECT_DOUBLE_EQ(sums.right()[0] / sums.normal()(0, 0), 1) << "0.5 + 0.5 and 3 - 2";
}

// A sum in which the past counts a share k has k times its slopes and k squared times its variance.
TEST(RecursiveLeastSquares, WhatIsForgottenIsForgottenInAllSums) {
  RecursiveLeastSquares sums(1);
  const Vector zero = Vector::Zero(1);
  sums.join(measured(-8, 4), zero, 1);
  sums.join(measured(-2, 4), zero, 0.5);
  EXPECT_DOUBLE_EQ(sums.normal()(0, 0), 1.5);
  EXPECT_DOUBLE_EQ(sums.strength()[0], 1.5);
  EXPECT_DOUBLE_EQ(sums.right()[0], 0.5 * 8 + 2);
  EXPECT_DOUBLE_EQ(sums.covariance()(0, 0), 0.25 * 4 + 4);
  sums.reset();
  EXPECT_EQ(sums.normal()(0, 0), 0);
  EXPECT_EQ(sums.covariance()(0, 0), 0);
  EXPECT_EQ(sums.strength()[0], 0);
  EXPECT_EQ(sums.right()[0], 0);
}

}  // namespace
}  // namespace selenite
