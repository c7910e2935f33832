// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/write.h"

#include <cmath>

#include "image/file_error.h"
#include "image/read.h"
#include "image/temporary_folder.h"
#include "math/error.h"
#include "math/srgb.h"

namespace selenite {
namespace {

using WriteImage = TemporaryFolder;

std::vector<float> ramp(int count) {
  std::vector<float> pixels;
  for (int i = 0; i < count; ++i)
    pixels.push_back(static_cast<float>(i) / static_cast<float>(count));
  return pixels;
}

TEST(SrgbCurve, GoesBothWays) {
  for (int i = 0; i <= 1000; ++i) {
    const float x = static_cast<float>(i) / 1000;
    EXPECT_NEAR(srgb_decode(srgb_encode(x)), x, 2e-7);
    EXPECT_NEAR(srgb_encode(srgb_decode(x)), x, 2e-6);
  }
  EXPECT_NEAR(srgb_decode(0.5f), 0.21404114, 1e-7);
  EXPECT_NEAR(srgb_encode(0.18f), 0.46135613, 1e-6);
}

TEST_F(WriteImage, ExrComesBackBitForBit) {
  std::vector<float> pixels = ramp(5 * 4 * 3);
  pixels[7] = 1e6f;
  pixels[8] = 1e-30f;
  write_exr(path("a.exr"), pixels.data(), 5, 4, 3);
  const Photo photo = read_photo(path("a.exr"));
  EXPECT_EQ(photo.pixels, pixels);
  EXPECT_EQ(photo.info.width, 5);
  EXPECT_EQ(photo.info.height, 4);
  EXPECT_EQ(photo.info.bit_depth, 32);
  EXPECT_TRUE(photo.info.is_float);
}

TEST_F(WriteImage, PngComesBackWithinHalfAStep) {
  std::vector<float> pixels = ramp(16 * 8 * 3);
  for (const int bits : {8, 16}) {
    write_png(path("a.png"), pixels.data(), 16, 8, 3, bits);
    const Photo photo = read_photo(path("a.png"));
    EXPECT_EQ(photo.info.bit_depth, bits);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      EXPECT_NEAR(srgb_encode(photo.pixels[i]), srgb_encode(pixels[i]),
                  0.501 / (bits == 8 ? 255 : 65535) + 1e-6);
  }
}

TEST_F(WriteImage, PngCutsWhatItCannotHold) {
  const std::vector<float> pixels{-1, 2, std::nanf("")};
  write_png(path("a.png"), pixels.data(), 1, 1, 3);
  EXPECT_EQ(read_photo(path("a.png")).pixels, (std::vector<float>{0, 1, 0}));
}

TEST_F(WriteImage, RowZeroIsAtTheTop) {
  std::vector<float> pixels(4 * 3 * 3, 0.f);
  pixels[0] = 1;
  write_png(path("a.png"), pixels.data(), 4, 3, 3);
  write_exr(path("a.exr"), pixels.data(), 4, 3, 3);
  EXPECT_EQ(read_photo(path("a.png")).pixels, pixels);
  EXPECT_EQ(read_photo(path("a.exr")).pixels, pixels);
}

TEST_F(WriteImage, EqualPicturesAreEqualFiles) {
  const std::vector<float> pixels = ramp(16 * 8 * 3);
  for (const char* name : {"a", "b"}) {
    write_exr(path(std::string(name) + ".exr"), pixels.data(), 16, 8, 3);
    write_png(path(std::string(name) + ".png"), pixels.data(), 16, 8, 3);
  }
  EXPECT_EQ(read_bytes("a.exr"), read_bytes("b.exr"));
  EXPECT_EQ(read_bytes("a.png"), read_bytes("b.png"));
  EXPECT_EQ(read_bytes("a.png").find("tEXt"), std::string::npos);
  EXPECT_EQ(read_bytes("a.png").find("tIME"), std::string::npos);
}

TEST_F(WriteImage, LeavesNoTemporaryFileAndReplacesTheOldOne) {
  write_bytes("a.png", "old");
  const std::vector<float> pixels{1, 1, 1};
  write_png(path("a.png"), pixels.data(), 1, 1, 3);
  EXPECT_EQ(file_count(), 1u);
  EXPECT_EQ(read_photo(path("a.png")).pixels, pixels);
}

TEST_F(WriteImage, AFailureKeepsTheOldFileAndNamesThePath) {
  const std::vector<float> pixels{1, 1, 1};
  const std::string missing = path("missing/a.png");
  const auto message = message_of<FileError>([&] { write_png(missing, pixels.data(), 1, 1, 3); });
  EXPECT_NE(message.find(missing), std::string::npos) << message;
  EXPECT_NE(message_of<FileError>([&] { write_exr(missing, pixels.data(), 1, 1, 3); }), "");
  std::filesystem::create_directories(path("folder.exr/full"));
  EXPECT_NE(message_of<FileError>([&] { write_exr(path("folder.exr"), pixels.data(), 1, 1, 3); }),
            "");
  EXPECT_EQ(file_count(), 1u) << "temporary files are cleaned up";
}

TEST_F(WriteImage, ChannelNamesAreChecked) {
  const std::vector<float> pixels{1, 2};
  write_exr(path("a.exr"), pixels.data(), 1, 1, 2, {"Y", "A"});
  EXPECT_EQ(read_photo(path("a.exr")).alpha.size(), 1u);
  EXPECT_THROW(write_exr(path("b.exr"), pixels.data(), 1, 1, 2), InvalidArgument);
  EXPECT_THROW(write_exr(path("b.exr"), pixels.data(), 1, 1, 2, {"Y", "Y"}), InvalidArgument);
  EXPECT_THROW(write_exr(path("b.exr"), pixels.data(), 0, 1, 2, {"Y", "A"}), InvalidArgument);
  EXPECT_THROW(write_png(path("b.png"), pixels.data(), 1, 1, 2), InvalidArgument);
  EXPECT_THROW(write_png(path("b.png"), pixels.data(), 2, 1, 1, 12), InvalidArgument);
}

TEST_F(WriteImage, PathsMayHoldAnyCharacter) {
  const std::vector<float> pixels{1, 1, 1};
#ifdef _WIN32  // no quotes in names
  const char* const quoted = "a 'b' $HOME %d.png";
#else
  const char* const quoted = "a 'b' \"c\" $HOME %d.png";
#endif
  for (const char* name : {"mondstein é 石.png", quoted}) {
    write_png(path(name), pixels.data(), 1, 1, 3);
    EXPECT_EQ(read_photo(path(name)).pixels, pixels) << name;
  }
}

}  // namespace
}  // namespace selenite
