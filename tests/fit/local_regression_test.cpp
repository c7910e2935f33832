// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/local_regression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kWidth = 60, kHeight = 40;
constexpr Eigen::Index kCount = Eigen::Index{3} * kWidth * kHeight;

Eigen::VectorXf over_picture(const auto& value) {
  Eigen::VectorXf numbers(kCount);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) numbers[3 * (y * kWidth + x) + c] = value(x, y, c);
  return numbers;
}

/// A board seen unsharply; its channels differ.
float board(double x, double y, int c) {
  return static_cast<float>(0.6 + 0.3 * std::tanh(3 * std::sin(0.5 * x + c) * std::sin(0.45 * y)));
}

Eigen::VectorXf noise(unsigned seed) {
  std::mt19937 random(seed);
  Normal<float> normal;
  return Eigen::VectorXf::NullaryExpr(kCount, [&] { return normal(random); });
}

Eigen::VectorXf picture() { return over_picture(board); }
/// What the board's motion across does to the picture.
Eigen::VectorXf moved() {
  return over_picture(
      [](int x, int y, int c) { return (board(x + 1, y, c) - board(x - 1, y, c)) / 2; });
}

TEST(LocalRegression, KeepsWhatAPictureThatMovesChangesBy) {
  const Eigen::VectorXf weight = Eigen::VectorXf::Ones(kCount);
  const Eigen::VectorXf found =
      local_regression(moved(), picture(), weight, kWidth, kHeight).col(0);
  // At the border the feature is a one-sided slope.
  EXPECT_LT((found - moved()).norm(), 0.1f * moved().norm());
}

TEST(LocalRegression, TakesMostOfTheNoiseAway) {
  const Eigen::VectorXf weight = Eigen::VectorXf::Ones(kCount);
  const float size = 5 * moved().norm() / std::sqrt(static_cast<float>(kCount));
  const Eigen::VectorXf seen = moved() + size * noise(1);
  const Eigen::VectorXf found = local_regression(seen, picture(), weight, kWidth, kHeight).col(0);
  // Five coefficients for 169 pixels leave 1/34 of the noise's power, and overlapping windows less.
  EXPECT_LT((found - moved()).squaredNorm(), (seen - moved()).squaredNorm() / 34);
  EXPECT_GT(found.dot(moved()), 0.6f * found.norm() * moved().norm());
}

TEST(LocalRegression, IsTheSameInStrips) {
  const Eigen::VectorXf weight = noise(2).cwiseAbs();
  Eigen::MatrixXf columns(kCount, 2);
  columns << noise(3), moved();
  const LocalRegressionOptions whole{.strip = kHeight}, strips{.strip = 7};
  const Eigen::MatrixXf one = local_regression(columns, picture(), weight, kWidth, kHeight, whole);
  const Eigen::MatrixXf other =
      local_regression(columns, picture(), weight, kWidth, kHeight, strips);
  EXPECT_LT((one - other).cwiseAbs().maxCoeff(), 1e-3f * one.cwiseAbs().maxCoeff());
}

TEST(LocalRegression, LeavesPixelsAloneThatCountForNothing) {
  const Eigen::VectorXf weight = over_picture([](int x, int, int) { return x < 30 ? 0.f : 1.f; });
  Eigen::VectorXf columns = moved();
  for (Eigen::Index i = 0; i < kCount; ++i)
    if (weight[i] == 0) columns[i] = 1e6f;
  const Eigen::MatrixXf found = local_regression(columns, picture(), weight, kWidth, kHeight);
  EXPECT_TRUE(found.allFinite());
  EXPECT_LT(found.cwiseAbs().maxCoeff(), 10.f);
  EXPECT_EQ(found(0, 0), 0) << "far from any pixel that counts";
}

}  // namespace
}  // namespace selenite
