// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/shared_pixels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fit/inference/normal_equations.h"
#include "fit/objective/shared_residual.h"
#include "fit/problem/pixel_weights.h"
#include "fit/synthetic_renderer.h"
#include "math/draws.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr int kFile = 34, kSide = 24, kDraws = 400;

/// A photo of which each pixel of the file has noise of its own, brought to a smaller size.
Photo noisy_photo(std::mt19937& random) {
  Normal<float> normal(0.5f, 0.1f);
  Photo file = grey_capture(kFile);
  for (Colorf& pixel : file.reference) pixel = Colorf(normal(random));
  check_photo(file);
  Photo photo = file.resized(kSide);
  photo.is_small = false;  // as if it were read at that size
  check_photo(photo);
  return photo;
}

/// Of a render that is right in the mean.
Eigen::VectorXf residual_of(const Photo& photo) {
  Eigen::VectorXf residual(static_cast<Eigen::Index>(3 * photo.size()));
  for (std::size_t i = 0; i < photo.size(); ++i)
    residual.segment<3>(static_cast<Eigen::Index>(3 * i)).setConstant(0.5f - photo.reference[i][0]);
  return residual;
}

TEST(SharedPixels, AreThereWhereTheSizeOfTheFileIsNoMultiple) {
  Photo photo = grey_capture(24);
  EXPECT_FALSE(shares_pixels(photo)) << "the file is not known";
  photo.frame.width = photo.frame.height = 24;
  EXPECT_FALSE(shares_pixels(photo));
  photo.frame.width = photo.frame.height = 96;
  EXPECT_FALSE(shares_pixels(photo));
  photo.frame.height = 95;
  EXPECT_TRUE(shares_pixels(photo));
  check_photo(photo);
  EXPECT_FALSE(shares_pixels(photo.resized(10))) << "a small picture of a search";
}

// The mean of 400 squares is within a quarter of 1 but once in 2000.
TEST(SharedPixels, NoiseInThemIsNoMisfit) {
  std::mt19937 random(5);
  double squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Photo photo = noisy_photo(random);
    const Eigen::VectorXf residual = residual_of(photo);
    SharedResidual shared;
    shared.add(photo, residual, residual, relative_weights(photo, 1));
    squares += square(shared.square) / shared.variance / kDraws;
  }
  EXPECT_NEAR(squares, 1, 0.25);
}

/// Equations of one unknown that brightens all pixels alike.
GaussNewton::PhotoEquations equations_of(const Eigen::VectorXf& residual) {
  const Jacobian slope = Jacobian::Ones(residual.size(), 1), none = 0 * slope;
  const InstrumentalVariables::Half half{slope, slope, none};
  GaussNewton::PhotoEquations equations;
  equations.whole.residual.residual_a = equations.whole.residual.residual_b = residual;
  equations.whole.z = {half, half};
  equations.whole.weight = Eigen::VectorXf::Ones(residual.size());
  return equations;
}

// By single pixels the variance would be 0.6 of what it is: intervals that are a quarter too narrow.
TEST(SharedPixels, TheCovarianceOfTheScoreKnowsOfThem) {
  std::mt19937 random(6);
  double squares = 0, variance = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Photo photo = noisy_photo(random);
    NormalEquations normal(1);
    normal.add(photo, equations_of(residual_of(photo)));
    squares += square(normal.gradient[0]) / kDraws;
    variance += normal.score_covariance(0, 0) / kDraws;
  }
  EXPECT_NEAR(variance / squares, 0.87, 0.17);
}

}  // namespace
}  // namespace selenite
