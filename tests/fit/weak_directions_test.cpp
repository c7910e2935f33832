// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/weak_directions.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

namespace selenite {
namespace {

// A light (in a logarithm) and a colour: photos show their product, and a third value well.
TEST(WeakDirections, NameWhatMakesUpForWhat) {
  const Eigen::Vector3d product(1, 1 / 0.5, 0), third(0, 0, 1);  // of colour 0.5
  Eigen::MatrixXd normal = 1e6 * product * product.transpose() + 1e6 * third * third.transpose();
  normal += Eigen::Vector3d(4, 40, 1).asDiagonal();  // what the bounds say
  const Vector ranges = Eigen::Vector3d(4.6, 1, 1);
  const std::vector<WeakDirection> found = weak_directions(normal.inverse(), ranges, {});
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].components, (std::vector<int>{1, 0})) << "the strongest in its range first";
  EXPECT_TRUE(found[0].photos.empty());
  EXPECT_GT(found[0].deviation, 0.1);
}

TEST(WeakDirections, AreNoneWhereAllIsDetermined) {
  const Eigen::MatrixXd covariance = Eigen::Vector2d(1e-4, 1e-4).asDiagonal();
  EXPECT_TRUE(weak_directions(covariance, Vector::Ones(2), {}).empty());
}

TEST(WeakDirections, OfOneValueThatNothingMakesUpForAreLeftOut) {
  const Eigen::MatrixXd covariance = Eigen::Vector2d(0.08, 1e-4).asDiagonal();
  EXPECT_TRUE(weak_directions(covariance, Vector::Ones(2), {}).empty());
}

// The first value is open because the gain of the second photo makes up for it.
TEST(WeakDirections, KnowTheGainsThatFollow) {
  const Eigen::MatrixXd covariance = Eigen::Vector2d(0.08, 1e-4).asDiagonal();
  const std::vector<Eigen::MatrixXd> slopes{Eigen::MatrixXd::Zero(0, 2),
                                            Eigen::MatrixXd::Constant(3, 2, -1.5)};
  const std::vector<WeakDirection> found = weak_directions(covariance, Vector::Ones(2), slopes);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].components, std::vector<int>{0});
  EXPECT_EQ(found[0].photos, std::vector<int>{1});
}

}  // namespace
}  // namespace selenite
