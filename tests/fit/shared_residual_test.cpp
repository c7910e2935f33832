// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/shared_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fit/problem/pixel_weights.h"
#include "fit/synthetic_renderer.h"
#include "math/draws.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr int kSide = 24;

/// A grey photo of which a disc counts.
Photo disc() {
  Photo photo = grey_capture(kSide);
  photo.weight.assign(photo.size(), 0.f);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      if (std::hypot(x - kSide / 2, y - kSide / 2) < 9)
        photo.weight[static_cast<std::size_t>(y) * kSide + x] = 1;
  check_photo(photo);
  return photo;
}

/// Mean square of sum over standard error where residuals have noise of a photo and of a render, a
/// twentieth of it as strong as eight times the rest.
double squared_scores(float of_photo, float of_render) {
  const Photo photo = disc();
  const Eigen::VectorXf weights = relative_weights(photo, 1);
  std::mt19937 random(3);
  Normal<float> normal;
  std::uniform_real_distribution<float> uniform;
  const auto noise = [&](float size) -> Eigen::VectorXf {
    return Eigen::VectorXf::NullaryExpr(weights.size(), [&](auto) {
      return size * normal(random) * (uniform(random) < 0.05f ? 8.f : 1.f);
    });
  };
  constexpr int kDraws = 400;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXf taken = noise(of_photo);
    SharedResidual shared;
    shared.add(photo, noise(of_render) - taken, noise(of_render) - taken, weights);
    sum += square(shared.square) / shared.variance / kDraws;
  }
  return sum;
}

// The mean of 400 squares is within a quarter of 1 but once in 2000. A photo's noise is in both halves:
// a pixel and its neighbour make the same product twice.
TEST(SharedResidual, KnowsItsNoiseWhoeverMadeIt) {
  EXPECT_NEAR(squared_scores(0.1f, 0), 1, 0.25) << "noise of the photo";
  EXPECT_NEAR(squared_scores(0, 0.1f), 1, 0.25) << "noise of the render";
  EXPECT_NEAR(squared_scores(0.1f, 0.1f), 1, 0.25) << "of both";
}

// A residual of a tenth everywhere is its square, whatever the mask.
TEST(SharedResidual, IsTheSquareOfWhatAllPixelsShare) {
  const Photo photo = disc();
  const Eigen::VectorXf weights = relative_weights(photo, 1),
                        residual = Eigen::VectorXf::Constant(weights.size(), 0.1f);
  SharedResidual shared;
  shared.add(photo, residual, residual, weights);
  const double all = weights.cast<double>().dot(residual.cwiseAbs2().cast<double>());
  EXPECT_NEAR(shared.square, all, 1e-4 * all);
  EXPECT_GT(shared.square, 10 * std::sqrt(shared.variance));
}

}  // namespace
}  // namespace selenite
