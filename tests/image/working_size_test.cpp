// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working/working_size.h"

#include <cmath>
#include <limits>

#include "image/file_error.h"
#include "image/temporary_folder.h"
#include "image/write.h"
#include "math/error.h"
#include "math/srgb.h"

namespace selenite {
namespace {

class WorkingSize : public TemporaryFolder {
 protected:
  std::string exr(const std::string& name, int width, int height, std::vector<float> pixels,
                  int channels = 3) {
    write_exr(path(name), pixels.data(), width, height, channels);
    return path(name);
  }
};

/// 6 x 4; the value at (x, y) is 1 + x + 10 y in all channels.
std::vector<float> ramp() {
  std::vector<float> pixels;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 6; ++x) pixels.insert(pixels.end(), 3, static_cast<float>(1 + x + 10 * y));
  return pixels;
}

TEST_F(WorkingSize, EveryPixelIsTheMeanOfWhatItCovers) {
  const WorkingPhoto half = read_at_size(exr("a.exr", 6, 4, ramp()), 3, 2);
  ASSERT_EQ(half.reference.size(), 18u);
  EXPECT_FLOAT_EQ(half.reference[0], (1 + 2 + 11 + 12) / 4.f);
  EXPECT_FLOAT_EQ(half.reference[15], (25 + 26 + 35 + 36) / 4.f);
  EXPECT_EQ(half.weight, std::vector<float>(6, 1.f));
  // A width of 4: each covers one pixel and a half.
  const WorkingPhoto cut = read_at_size(path("a.exr"), 4, 4);
  EXPECT_FLOAT_EQ(cut.reference[0], (1 + 0.5f * 2) / 1.5f);
  EXPECT_FLOAT_EQ(cut.reference[3], (0.5f * 2 + 3) / 1.5f);
}

TEST_F(WorkingSize, APixelCountsOnlyIfAllBelowItCan) {
  std::vector<float> pixels = ramp();
  pixels[0] = std::numeric_limits<float>::quiet_NaN();
  pixels[3 * 5] = -1;
  const WorkingPhoto photo = read_at_size(exr("a.exr", 6, 4, pixels), 3, 2);
  EXPECT_EQ(photo.weight, (std::vector<float>{0, 1, 0, 1, 1, 1}));
  EXPECT_EQ(photo.counts[PixelUse::kNotFinite], 1);
  EXPECT_EQ(photo.counts[PixelUse::kNegative], 1);
  EXPECT_EQ(photo.counts.all(), 24);
  EXPECT_EQ(photo.info.warnings.size(), 2u);
  for (const float value : photo.reference) EXPECT_TRUE(std::isfinite(value));
}

TEST_F(WorkingSize, MaskAndAlphaAreWeights) {
  std::vector<float> pixels, mask;
  for (int i = 0; i < 4; ++i) {
    pixels.insert(pixels.end(), {0.1f, 0.2f, 0.3f, i == 1 ? 0.f : 0.5f});
    mask.push_back(i == 2 ? 0.f : 0.5f);
  }
  const std::string photo = exr("a.exr", 4, 1, pixels, 4), file = exr("mask.exr", 4, 1, mask, 1);
  const WorkingPhoto both = read_at_size(photo, 4, 1, {.masks = {{file}}});
  EXPECT_NEAR(both.weight[0], 0.25, 1e-5);
  EXPECT_EQ(both.weight[1], 0.f);
  EXPECT_EQ(both.weight[2], 0.f);
  EXPECT_NEAR(both.weight[3], 0.25, 1e-5);
}

// A render of such a pixel shows background too.
TEST_F(WorkingSize, APixelWithBackgroundBelowItDoesNotCount) {
  const std::vector<float> pixels{0.1f, 0.2f, 0.3f, 1, 0.1f, 0.2f, 0.3f, 0,
                                  0.1f, 0.2f, 0.3f, 1, 0.1f, 0.2f, 0.3f, 1};
  const WorkingPhoto small = read_at_size(exr("a.exr", 4, 1, pixels, 4), 2, 1, {});
  EXPECT_EQ(small.weight[0], 0.f);
  EXPECT_EQ(small.weight[1], 1.f);
}

TEST_F(WorkingSize, AMaskThatIsNotFiniteIsCountedAndDoesNotCount) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string photo = exr("a.exr", 4, 1, std::vector<float>(12, 0.5f));
  const std::string mask = exr("mask.exr", 4, 1, {1, nan, -1, 3}, 1);
  const WorkingPhoto masked = read_at_size(photo, 4, 1, {.masks = {{mask}}});
  EXPECT_EQ(masked.weight, (std::vector<float>{1, 0, 0, 1}));
  EXPECT_EQ(masked.masks.at(0).counts[PixelUse::kNotFinite], 1);
  EXPECT_EQ(masked.masks.at(0).counts[PixelUse::kNegative], 1);
  EXPECT_EQ(masked.masks.at(0).info.warnings.size(), 3u);
  EXPECT_TRUE(masked.info.warnings.empty());
}

TEST_F(WorkingSize, AMaskOfAnotherSizeCountsOnlyWhereNoneOfItIsBlack) {
  const std::string photo = exr("a.exr", 4, 2, std::vector<float>(24, 0.5f));
  // Twice the size: one black pixel takes the photo's pixel over it, a grey one a part of its weight.
  std::vector<float> fine(32, 1.f);
  fine[8 + 3] = 0;      // (3, 1)
  fine[16 + 6] = 0.5f;  // (6, 2)
  const WorkingPhoto large =
      read_at_size(photo, 4, 2, {.masks = {{exr("large.exr", 8, 4, fine, 1)}}});
  EXPECT_EQ(large.weight[1], 0.f);
  EXPECT_NEAR(large.weight[7], (3 + 0.5) / 4, 1e-4);
  EXPECT_EQ(large.inside, (std::vector<float>{1, 0, 1, 1, 1, 1, 1, 1}));
  // Half the size: its left pixel lies over four of the photo.
  const WorkingPhoto small =
      read_at_size(photo, 4, 2, {.masks = {{exr("s.exr", 2, 1, {0, 1}, 1)}}});
  EXPECT_EQ(small.weight, (std::vector<float>{0, 0, 1, 1, 0, 0, 1, 1}));
  // Three for four: the second pixel of the photo lies by a third in the black column.
  const std::string wide = exr("w.exr", 4, 4, std::vector<float>(48, 0.5f));
  const std::string third = exr("t.exr", 3, 3, {0, 1, 1, 0, 1, 1, 0, 1, 1}, 1);
  EXPECT_EQ(read_at_size(wide, 4, 1, {.masks = {{third}}}).weight,
            (std::vector<float>{0, 0, 1, 1}));
}

TEST_F(WorkingSize, AClippedPixelIsInsideAllTheSame) {
  std::vector<float> pixels = ramp();
  pixels[0] = std::numeric_limits<float>::quiet_NaN();
  const WorkingPhoto photo = read_at_size(exr("a.exr", 6, 4, pixels), 3, 2);
  EXPECT_EQ(photo.weight[0], 0.f);
  EXPECT_EQ(photo.inside, std::vector<float>(6, 1));
}

std::vector<double> corners_of(int width, int height, double left, double top, double step_x,
                               double step_y) {
  std::vector<double> corners;
  for (int y = 0; y <= height; ++y)
    for (int x = 0; x <= width; ++x)
      corners.insert(corners.end(), {left + x * step_x, top + y * step_y});
  return corners;
}

TEST_F(WorkingSize, EvenCornersAreTheAreaFilter) {
  const std::string photo = exr("a.exr", 6, 4, ramp());
  const WorkingPhoto expected = read_at_size(photo, 3, 2);
  const WorkingPhoto got = read_at_size(photo, 3, 2, {.corners = corners_of(3, 2, 0, 0, 2, 2)});
  ASSERT_EQ(got.reference.size(), expected.reference.size());
  for (std::size_t i = 0; i < got.reference.size(); ++i)
    EXPECT_NEAR(got.reference[i], expected.reference[i], 1e-4);
  EXPECT_EQ(got.weight, expected.weight);
  EXPECT_EQ(got.counts.all(), 24);
}

TEST_F(WorkingSize, ShiftedCornersTakeTheirShares) {
  const std::string photo = exr("a.exr", 6, 4, ramp());
  // Two pixels of the photo high, and a half of one to the right and down.
  const WorkingPhoto got = read_at_size(photo, 2, 1, {.corners = corners_of(2, 1, 0.5, 0.5, 2, 2)});
  // The ramp is linear, so the mean is its value in the middle: centre (1.5, 1.5) - (0.5, 0.5).
  EXPECT_NEAR(got.reference[0], 1 + 1 + 10 * 1, 1e-4);
  EXPECT_NEAR(got.reference[3], 1 + 3 + 10 * 1, 1e-4);
  EXPECT_EQ(got.weight, (std::vector<float>{1, 1}));
}

TEST_F(WorkingSize, WhatLiesOutsideOfThePhotoHasNoWeight) {
  const std::string photo = exr("a.exr", 6, 4, ramp());
  std::vector<double> corners = corners_of(3, 2, -0.25, 0, 2, 2);
  corners[2 * 7] = std::numeric_limits<double>::quiet_NaN();  // of the right column, first row
  const WorkingPhoto got = read_at_size(photo, 3, 2, {.corners = corners});
  EXPECT_EQ(got.weight, (std::vector<float>{0, 1, 0, 0, 1, 0}));
  for (const float value : got.reference) EXPECT_TRUE(std::isfinite(value));
}

TEST_F(WorkingSize, AResponseTakesThePlaceOfWhatTheFileSays) {
  const std::vector<float> light{0.25f, 0.25f, 0.25f};
  write_png(path("a.png"), light.data(), 1, 1, 3, 16);  // sRGB of it
  const double code = srgb_encode(0.25f);
  const auto with = [&](Response response) {
    return static_cast<double>(
        read_at_size(path("a.png"), 1, 1, {.response = response}).reference[0]);
  };
  EXPECT_NEAR(with({}), 0.25, 1e-4);
  Response power;
  power.curves.assign(3, power_curve(2.2));
  EXPECT_NEAR(with(power), std::pow(code, 2.2), 1e-4);
  power.curves.assign(3, {});
  EXPECT_NEAR(with(power), code, 1e-4);
  const Response table = table_response({{0, 0, 0, 0}, {0.4, 0.1, 0, 0}, {0.8, 0.5, 1, 1}});
  EXPECT_NEAR(with(table), 0.1 + (code - 0.4) / 0.4 * 0.4, 1e-4);
}

TEST_F(WorkingSize, CodeValuesThatDoNotCountHaveNoWeight) {
  const std::string photo =
      exr("a.exr", 4, 1, {0.1f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.9f, 0.5f, 0.2f, 0.8f, 0.5f});
  Response response;
  response.counted.fill({0.15, 0.85});
  const WorkingPhoto got = read_at_size(photo, 4, 1, {.response = response});
  EXPECT_EQ(got.weight, (std::vector<float>{0, 1, 0, 1}));
  EXPECT_EQ(got.counts[PixelUse::kTooDark], 1);
  EXPECT_EQ(got.counts[PixelUse::kClipped], 1);
  EXPECT_EQ(got.info.warnings.size(), 2u);
  // Beyond its rows a table says nothing.
  const Response table = table_response({{0.15, 0, 0, 0}, {0.85, 1, 1, 1}});
  EXPECT_EQ(read_at_size(photo, 4, 1, {.response = table}).weight, got.weight);
}

TEST(TableResponse, RefusesWhatIsNoResponse) {
  const auto said = [](const std::vector<std::array<double, 4>>& rows) {
    return message_of<InvalidArgument>([&] { table_response(rows); });
  };
  EXPECT_NE(said({{0, 0, 0, 0}}).find("at least two rows"), std::string::npos);
  EXPECT_NE(said({{0, 0, 0, 0}, {0, 1, 1, 1}}).find("row 2"), std::string::npos);
  EXPECT_NE(said({{0, 0, 0, 0}, {1, 1, -1, 1}}).find("less light"), std::string::npos);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(said({{0, 0, nan, 0}, {1, 1, 1, 1}}).find("not finite"), std::string::npos);
  EXPECT_EQ(said({{0, 0, 0, 0}, {1, 1, 0, 1}}), "");
}

TEST_F(WorkingSize, AMaskOfAnotherShapeAndAnEnlargementAreRefused) {
  const std::string photo = exr("a.exr", 6, 4, ramp());
  const std::string mask = exr("mask.exr", 4, 6, std::vector<float>(24, 1.f), 1);
  const std::string text =
      message_of<FileError>([&] { read_at_size(photo, 3, 2, {.masks = {{mask}}}); });
  EXPECT_NE(text.find("4 x 6 pixels for a photo of 6 x 4"), std::string::npos) << text;
  EXPECT_NE(message_of<InvalidArgument>([&] { read_at_size(photo, 7, 4); }), "");
  EXPECT_NE(message_of<InvalidArgument>([&] { read_at_size(photo, 0, 4); }), "");
}

}  // namespace
}  // namespace selenite
