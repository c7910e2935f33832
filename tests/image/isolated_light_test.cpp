// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/isolated_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "image/temporary_folder.h"
#include "image/working/working_size.h"
#include "image/write.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSide = 96;
using Level = std::function<double(int x, int y)>;

std::vector<float> grey(const Level& level) {
  std::vector<float> pixels;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) pixels.insert(pixels.end(), 3, static_cast<float>(level(x, y)));
  return pixels;
}

IsolatedLight found(const std::vector<float>& pixels, std::vector<std::uint8_t> inside = {}) {
  if (inside.empty()) inside.assign(pixels.size() / 3, 1);
  IsolatedLight light(kSide, kSide);
  for (std::size_t y = 0; y < kSide; ++y)
    light.add(static_cast<int>(y), pixels.data() + 3 * kSide * y, inside.data() + kSide * y);
  return light;
}
IsolatedLight found(const Level& level) { return found(grey(level)); }

/// Of all pixels one in 50 is 20 times as bright.
std::vector<float> with_fireflies(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  return grey([&](int x, int) { return (uniform(random) < 0.02 ? 4 : 0.2) * (1 + x / 96.0); });
}

TEST(IsolatedLight, IsThatOfRareBrightPixels) {
  const IsolatedLight light = found(with_fireflies(1));
  EXPECT_NEAR(static_cast<double>(light.count()), 0.02 * 94 * 94, 40);
  // 0.02 * 19 / (1 + 0.02 * 19), without the few that touch two others.
  EXPECT_NEAR(light.share(), 0.275, 0.05);
}

TEST(IsolatedLight, NoneIsInEdgesLinesHighlightsAndOrdinaryNoise) {
  EXPECT_EQ(found([](int x, int y) { return x + y < 90 ? 0.01 : 5; }).count(), 0);
  EXPECT_EQ(found([](int x, int y) { return x % 7 == 3 || y == x ? 5 : 0.01; }).count(), 0);
  EXPECT_EQ(found([](int x, int y) { return (x / 3 + y / 3) % 2 == 0 ? 5 : 0.01; }).count(), 0);
  // Of lenses that spread a point over two pixels, many and a thousand times as bright as the rest.
  EXPECT_EQ(found([](int x, int y) {
              const double dx = x % 8 - 3.4, dy = y % 8 - 3.7;
              return 0.1 + 100 * std::exp(-(dx * dx + dy * dy) / 2);
            }).count(),
            0);
  std::mt19937 random(1);
  Normal<double> normal;
  EXPECT_LT(found([&](int, int) { return std::max(0.0, 1 + 0.3 * normal(random)); }).share(), 1e-4);
}

TEST(IsolatedLight, AFewHighlightsOfOnePixelAreNone) {
  const auto glints = [](int x, int y) { return x % 32 == 5 && y % 48 == 9 ? 1e4 : 0.1; };
  EXPECT_EQ(found(glints).count(), 6);
  EXPECT_EQ(found(glints).share(), 0);
}

TEST(IsolatedLight, WhatAMaskHidesCountsNeitherAsLightNorAsDarkNeighbour) {
  std::vector<std::uint8_t> inside(kSide * kSide);
  for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = i % kSide % 3 == 0;  // thin strips
  EXPECT_EQ(found(with_fireflies(1), inside).count(), 0);
  for (std::size_t i = 0; i < inside.size(); ++i) inside[i] = i % kSide < kSide / 2;
  std::vector<float> bright_outside = with_fireflies(1);
  for (std::size_t i = 0; i < bright_outside.size(); ++i)
    if (i / 3 % kSide >= kSide / 2) bright_outside[i] *= 100;
  const double half = found(with_fireflies(1), inside).share();
  EXPECT_GT(half, 0.2);
  EXPECT_DOUBLE_EQ(found(bright_outside, inside).share(), half);
}

TEST(IsolatedLight, RowsMayComeInAnyOrder) {
  const std::vector<float> pixels = with_fireflies(2);
  const std::vector<std::uint8_t> inside(kSide, 1);
  IsolatedLight light(kSide, kSide);
  for (const int first : {2, 0, 3, 1})  // rows 2, 6, ..., then 0, 4, ...
    for (int y = first; y < kSide; y += 4)
      light.add(y, pixels.data() + 3 * static_cast<std::ptrdiff_t>(kSide) * y, inside.data());
  EXPECT_EQ(light.count(), found(pixels).count());
  EXPECT_NEAR(light.share(), found(pixels).share(), 1e-12);
}

class IsolatedLightOfAFile : public TemporaryFolder {};

TEST_F(IsolatedLightOfAFile, IsToldAtAnyWorkingSize) {
  const std::vector<float> noisy = with_fireflies(3);
  write_exr(path("noisy.exr"), noisy.data(), kSide, kSide, 3);
  for (const int size : {kSide, 64, 12}) {
    const WorkingPhoto photo = read_at_size(path("noisy.exr"), size, size);
    EXPECT_DOUBLE_EQ(photo.isolated, found(noisy).share());
    ASSERT_EQ(photo.info.warnings.size(), 1u);
    EXPECT_NE(photo.info.warnings[0].find("isolated bright pixels"), std::string::npos);
  }
  const std::vector<float> even = grey([](int x, int) { return 0.2 + x / 96.0; });
  write_exr(path("even.exr"), even.data(), kSide, kSide, 3);
  EXPECT_EQ(read_at_size(path("even.exr"), 64, 64).isolated, 0);
  EXPECT_TRUE(read_at_size(path("even.exr"), 64, 64).info.warnings.empty());
}

}  // namespace
}  // namespace selenite
