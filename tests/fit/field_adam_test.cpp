// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/field_adam.h"

#include <gtest/gtest.h>

#include <cmath>

#include "fit/image_scenes.h"

namespace selenite {
namespace {

constexpr int kSide = 24;

/// Texels along a row that Adam's first step moves, where red of one texel in the middle has a gradient.
int moved_by(double spread) {
  Scene scene = board(std::vector<float>(kTexels * kTexels, 0.5f));
  scene.appearance.materials[0].maps[0].texture = std::make_shared<Texture>(
      "Wood", kSide, kSide, std::vector<Colorf>(kSide * kSide, Colorf(0.5f)), std::vector<float>(),
      false, Extension::kExtend, Interpolation::kLinear);
  const Fields fields(scene, {texels()});
  FieldAdam adam(fields);
  FieldValues values = fields.start();
  std::vector<double> gradient(3 * kSide * kSide);
  constexpr std::size_t kMiddle = kSide / 2 * kSide + kSide / 2;
  gradient[3 * kMiddle] = 1;
  adam.step(values, {gradient}, {{1, spread}});
  int count = 0;
  for (int x = 0; x < kSide; ++x) count += values[0][3 * (kSide / 2 * kSide + x)] != 0.5;
  return count;
}

// An area A is that of a Gaussian with 4 pi sigma^2 = A, which reaches three standard deviations. Adam's
// first step moves by its whole length whatever is told anything, however little.
TEST(FieldAdam, SmoothsAGradientOverTheAreaThatItIsTold) {
  EXPECT_EQ(moved_by(0), 1);
  for (const double sigma : {0.9, 1.6, 2.9}) {
    const double area = 4 * std::acos(-1.0) * sigma * sigma;
    EXPECT_EQ(moved_by(area / (kSide * kSide)), 1 + 2 * std::ceil(3 * sigma)) << sigma;
  }
}

}  // namespace
}  // namespace selenite
