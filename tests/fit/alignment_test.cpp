// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/problem/pixel_weights.h"
#include "fit/synthetic_renderer.h"

namespace selenite {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// A smooth picture with slopes in both directions.
Colorf scenery(double x, double y) {
  const auto level =
      static_cast<float>(0.5 + 0.3 * std::sin(0.31 * x + 0.05 * y) * std::cos(0.23 * y));
  return Colorf(level, 0.8f * level, 0.6f);
}

Photo photo() {
  Photo photo = photo_of_size("Left", kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      photo.reference[static_cast<std::size_t>(y) * kWidth + x] = scenery(x + 0.5, y + 0.5);
  photo.align = true;
  check_photo(photo);
  return photo;
}

/// Of a camera that sees what lies off by `wrong`, once it is moved by `present`.
Film render(const Alignment& wrong, const Alignment& present) {
  Film film(kWidth, kHeight, 4);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double roll = present.roll - wrong.roll, px = x + 0.5, py = y + 0.5;
      // Right and up from the middle, turned against the clock.
      const double right = px - kWidth / 2.0, up = kHeight / 2.0 - py;
      const double to_right = std::cos(roll) * right - std::sin(roll) * up;
      const double to_up = std::sin(roll) * right + std::cos(roll) * up;
      film.mean[static_cast<std::size_t>(y) * kWidth + x] =
          scenery(kWidth / 2.0 + to_right + present.x - wrong.x,
                  kHeight / 2.0 - to_up + present.y - wrong.y);
    }
  return film;
}

TEST(Alignment, IsFoundByThePhotosOwnGradient) {
  const Photo one = photo();
  const Eigen::VectorXf weights = relative_weights(one, 1);
  const AlignmentEquations equations(one, weights);
  const Alignment wrong{1.7, -2.2, 0.01};
  AlignmentEstimate found = equations.prior();
  for (int step = 0; step < 12; ++step) found = equations.improved(found, render(wrong, found.at));
  EXPECT_NEAR(found.at.x, wrong.x, 0.03);
  EXPECT_NEAR(found.at.y, wrong.y, 0.03);
  EXPECT_NEAR(found.at.roll, wrong.roll, 5e-4);
}

/// The render with a normal error of each number, which its variance tells.
Film noisy(Film film, float deviation, std::uint64_t seed) {
  for (std::size_t i = 0; i < film.size(); ++i) {
    Random random(seed, static_cast<std::uint32_t>(i), 0);
    for (int c = 0; c < 3; ++c) {
      const auto d = static_cast<std::uint32_t>(2 * c);
      const double radius = std::sqrt(-2 * std::log(1 - random.uniform(d)));
      const double normal = radius * std::cos(2 * kPi<double> * random.uniform(d + 1));
      film.mean[i][c] += deviation * static_cast<float>(normal);
      film.variance[i][c] = deviation * deviation;
    }
  }
  return film;
}

// One render of this noise is off by a third of a pixel, a roll by 0.01.
TEST(Alignment, RendersOfMuchNoiseMoveItLittle) {
  const Photo one = photo();
  const Eigen::VectorXf weights = relative_weights(one, 1);
  const AlignmentEquations equations(one, weights);
  const Alignment wrong{1.2, -0.8, 0.01};
  AlignmentEstimate found = equations.prior();
  double off = 0, rolled = 0;
  constexpr int kRenders = 120, kFirst = 20;
  for (int n = 0; n < kRenders; ++n) {
    found = equations.improved(found,
                               noisy(render(wrong, found.at), 0.6f, static_cast<std::uint64_t>(n)));
    if (n < kFirst) continue;
    off += square(found.at.x - wrong.x) + square(found.at.y - wrong.y);
    rolled += square(found.at.roll - wrong.roll);
  }
  EXPECT_LT(std::sqrt(off / (2 * (kRenders - kFirst))), 0.12);
  EXPECT_LT(std::sqrt(rolled / (kRenders - kFirst)), 0.004);
}

TEST(Alignment, StaysWithinFourPixels) {
  const Photo one = photo();
  const Eigen::VectorXf weights = relative_weights(one, 1);
  const AlignmentEquations equations(one, weights);
  AlignmentEstimate found = equations.prior();
  for (int step = 0; step < 12; ++step)
    found = equations.improved(found, render({5, 0, 0}, found.at));
  EXPECT_EQ(found.at.x, kAlignment.most);
}

// What the moved camera sees at a pixel is what it saw at the pixel farther on.
TEST(Alignment, MovesTheCameraByPixels) {
  Camera camera;
  const Alignment moved{1.5, -2.5, 0};
  const Camera other = moved.apply(camera, kWidth, kHeight, {});
  const Vec3d point{0.1, -0.2, -3};
  const Vec2<double> before = PixelCamera(camera, kWidth, kHeight).project(point);
  const Vec2<double> after = PixelCamera(other, kWidth, kHeight).project(point);
  EXPECT_NEAR(before.x - after.x, moved.x, 1e-9);
  EXPECT_NEAR(before.y - after.y, moved.y, 1e-9);
  // A roll against the clock: a point to the right appears lower.
  const Camera rolled = Alignment{0, 0, 0.1}.apply(camera, kWidth, kHeight, {});
  const Vec3d right{1, 0, -3};
  const Vec2<double> was = PixelCamera(camera, kWidth, kHeight).project(right);
  const Vec2<double> is = PixelCamera(rolled, kWidth, kHeight).project(right);
  EXPECT_NEAR(is.y - was.y, std::sin(0.1) * (was.x - kWidth / 2.0), 1e-9);
}

// A parameter that moves the picture as the alignment does is left with nothing.
TEST(Alignment, EliminationTakesWhatAShiftMakesOfThePicture) {
  const Photo one = photo();
  const AlignmentSlopes slopes = alignment_slopes(one);
  Eigen::VectorXf column = 2 * slopes.col(0) - slopes.col(1);
  const float before = column.norm();
  const Eigen::VectorXf weights = relative_weights(one, 1);
  AlignmentEquations(one, weights).eliminate(column);
  EXPECT_LT(column.norm(), 0.02f * before);
}

}  // namespace
}  // namespace selenite
