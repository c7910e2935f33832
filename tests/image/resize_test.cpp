// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/resize.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "math/error.h"
#include "math/rng.h"

namespace selenite {
namespace {

std::vector<float> noise(int width, int height, int channels) {
  std::vector<float> pixels;
  const int count = width * height * channels;
  for (int i = 0; i < count; ++i)
    pixels.push_back(Random(1, static_cast<std::uint32_t>(i), 0).uniform(0));
  return pixels;
}

double mean(const std::vector<float>& pixels) {
  return std::accumulate(pixels.begin(), pixels.end(), 0.0) / static_cast<double>(pixels.size());
}

TEST(Resize, WholeRatiosAreBlockMeans) {
  const std::vector<float> pixels{1, 2, 3, 4, 5, 6, 7, 8};  // 4 x 2
  EXPECT_EQ(resize(pixels.data(), 4, 2, 1, 2, 1), (std::vector<float>{3.5f, 5.5f}));
}

TEST(Resize, CutPixelsCountByTheirShare) {
  const std::vector<float> row{3, 6, 12};  // 3 -> 2: 1.5 pixels each
  const std::vector<float> expected{(3 + 0.5f * 6) / 1.5f, (0.5f * 6 + 12) / 1.5f};
  const std::vector<float> across = resize(row.data(), 3, 1, 1, 2, 1);
  const std::vector<float> down = resize(row.data(), 1, 3, 1, 1, 2);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_FLOAT_EQ(across[i], expected[i]);
    EXPECT_FLOAT_EQ(down[i], expected[i]);
  }
}

TEST(Resize, ChannelsStayApart) {
  const std::vector<float> pixels{1, 10, 100, 3, 30, 300};  // 2 x 1 x 3
  EXPECT_EQ(resize(pixels.data(), 2, 1, 3, 1, 1), (std::vector<float>{2, 20, 200}));
}

TEST(Resize, EnlargingFollowsTheSameRule) {
  const std::vector<float> row{0, 3};
  EXPECT_EQ(resize(row.data(), 2, 1, 1, 4, 1), (std::vector<float>{0, 0, 3, 3}));
  const std::vector<float> three = resize(row.data(), 2, 1, 1, 3, 1);
  EXPECT_FLOAT_EQ(three[0], 0);
  EXPECT_FLOAT_EQ(three[1], 1.5f);
  EXPECT_FLOAT_EQ(three[2], 3);
}

TEST(Resize, TheSameSizeChangesNothing) {
  const std::vector<float> pixels = noise(7, 5, 3);
  EXPECT_EQ(resize(pixels.data(), 7, 5, 3, 7, 5), pixels);
}

TEST(Resize, KeepsTheMean) {
  const std::vector<float> pixels = noise(97, 61, 3);
  for (const auto& [w, h] : {std::pair{13, 7}, {48, 30}, {96, 60}, {1, 1}, {200, 150}})
    EXPECT_NEAR(mean(resize(pixels.data(), 97, 61, 3, w, h)), mean(pixels), 1e-7)
        << w << " x " << h;
}

TEST(Resize, AConstantStaysThatConstant) {
  const std::vector<float> pixels(31 * 17, 0.7f);
  for (float x : resize(pixels.data(), 31, 17, 1, 11, 23)) EXPECT_EQ(x, 0.7f);
}

TEST(Resize, NanStaysWhereItIs) {
  std::vector<float> pixels(8 * 8, 1.f);
  pixels[0] = std::nanf("");
  const std::vector<float> small = resize(pixels.data(), 8, 8, 1, 4, 4);
  EXPECT_TRUE(std::isnan(small[0]));
  for (std::size_t i = 1; i < small.size(); ++i) EXPECT_EQ(small[i], 1.f);
}

TEST(Resize, RefusesSizesThatHoldNothingOrTooMuch) {
  const float pixel = 1;
  EXPECT_THROW(resize(&pixel, 0, 1, 1, 1, 1), InvalidArgument);
  EXPECT_THROW(resize(&pixel, 1, 1, 0, 1, 1), InvalidArgument);
  EXPECT_THROW(resize(&pixel, 1, 1, 1, 0, 1), InvalidArgument);
  EXPECT_THROW(resize(&pixel, 1, 1, 1, 1, -1), InvalidArgument);
  EXPECT_THROW(resize(&pixel, 1, 1, 1, 60000, 60000), InvalidArgument);
}

}  // namespace
}  // namespace selenite
