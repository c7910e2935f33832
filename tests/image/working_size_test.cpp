// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/working_size.h"

#include <cmath>
#include <limits>

#include "image/file_error.h"
#include "image/temporary_folder.h"
#include "image/write.h"
#include "math/error.h"

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
  const WorkingPhoto half = read_at_size(exr("a.exr", 6, 4, ramp()), "", 3, 2);
  ASSERT_EQ(half.reference.size(), 18u);
  EXPECT_FLOAT_EQ(half.reference[0], (1 + 2 + 11 + 12) / 4.f);
  EXPECT_FLOAT_EQ(half.reference[15], (25 + 26 + 35 + 36) / 4.f);
  EXPECT_EQ(half.weight, std::vector<float>(6, 1.f));
  // A width of 4: each covers one pixel and a half.
  const WorkingPhoto cut = read_at_size(path("a.exr"), "", 4, 4);
  EXPECT_FLOAT_EQ(cut.reference[0], (1 + 0.5f * 2) / 1.5f);
  EXPECT_FLOAT_EQ(cut.reference[3], (0.5f * 2 + 3) / 1.5f);
}

TEST_F(WorkingSize, APixelCountsOnlyIfAllBelowItCan) {
  std::vector<float> pixels = ramp();
  pixels[0] = std::numeric_limits<float>::quiet_NaN();
  pixels[3 * 5] = -1;
  const WorkingPhoto photo = read_at_size(exr("a.exr", 6, 4, pixels), "", 3, 2);
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
  const WorkingPhoto both = read_at_size(photo, file, 4, 1);
  EXPECT_NEAR(both.weight[0], 0.25, 1e-5);
  EXPECT_EQ(both.weight[1], 0.f);
  EXPECT_EQ(both.weight[2], 0.f);
  EXPECT_NEAR(both.weight[3], 0.25, 1e-5);
}

TEST_F(WorkingSize, AMaskThatIsNotFiniteIsCountedAndDoesNotCount) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string photo = exr("a.exr", 4, 1, std::vector<float>(12, 0.5f));
  const std::string mask = exr("mask.exr", 4, 1, {1, nan, -1, 3}, 1);
  const WorkingPhoto masked = read_at_size(photo, mask, 4, 1);
  EXPECT_EQ(masked.weight, (std::vector<float>{1, 0, 0, 1}));
  EXPECT_EQ(masked.mask_counts[PixelUse::kNotFinite], 1);
  EXPECT_EQ(masked.mask_counts[PixelUse::kNegative], 1);
  EXPECT_EQ(masked.mask_info.warnings.size(), 3u);
  EXPECT_TRUE(masked.info.warnings.empty());
}

TEST_F(WorkingSize, AMaskOfAnotherSizeAndAnEnlargementAreRefused) {
  const std::string photo = exr("a.exr", 6, 4, ramp());
  const std::string mask = exr("mask.exr", 4, 6, std::vector<float>(24, 1.f), 1);
  const std::string text = message_of<FileError>([&] { read_at_size(photo, mask, 3, 2); });
  EXPECT_NE(text.find("4 x 6 pixels for a photo of 6 x 4"), std::string::npos) << text;
  EXPECT_NE(message_of<InvalidArgument>([&] { read_at_size(photo, "", 7, 4); }), "");
  EXPECT_NE(message_of<InvalidArgument>([&] { read_at_size(photo, "", 0, 4); }), "");
}

}  // namespace
}  // namespace selenite
