// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/read.h"

#include <OpenImageIO/imageio.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "image/cmyk_jpeg.h"
#include "image/file_error.h"
#include "image/picture_bytes.h"
#include "image/temporary_folder.h"
#include "image/write.h"
#include "math/draws.h"

namespace selenite {
namespace {

constexpr int kSize = 16;

class ReadPhoto : public TemporaryFolder {
 protected:
  /// A picture file as another program would write it.
  template <class T>
  std::string save(const std::string& name, OIIO::ImageSpec spec, const std::vector<T>& pixels) {
    const auto out = OIIO::ImageOutput::create(name);
    EXPECT_TRUE(out && out->open(path(name), spec)) << OIIO::geterror();
    EXPECT_TRUE(out->write_image(OIIO::BaseTypeFromC<T>::value, pixels.data())) << out->geterror();
    out->close();
    return path(name);
  }
  template <class T>
  std::string save(const std::string& name, int channels, const std::vector<T>& pixels) {
    return save(
        name,
        OIIO::ImageSpec(kSize, kSize, channels, OIIO::TypeDesc(OIIO::BaseTypeFromC<T>::value)),
        pixels);
  }
  std::string refusal(const std::string& file) {
    const std::string probed = message_of<FileError>([&] { read_photo(file); });
    EXPECT_NE(probed, "") << file << " was accepted";
    EXPECT_NE(probed.find(file), std::string::npos) << probed;
    return probed;
  }
};

template <class T>
std::vector<T> gradient(int channels) {
  std::vector<T> pixels;
  for (int i = 0; i < kSize * kSize * channels; ++i)
    pixels.push_back(static_cast<T>(static_cast<double>(i) / (kSize * kSize * channels) *
                                    std::numeric_limits<T>::max()));
  return pixels;
}

std::vector<std::uint8_t> busy() {  // compresses badly, so that half a file is half a picture
  std::vector<std::uint8_t> pixels;
  std::minstd_rand random(1);
  for (int i = 0; i < 3 * kSize * kSize; ++i)
    pixels.push_back(static_cast<std::uint8_t>(random() >> 16));
  return pixels;
}

/// IEC 61966-2-1, written down here.
double decoded(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }

TEST_F(ReadPhoto, EightAndSixteenBitsAgree) {
  const std::vector<std::uint8_t> eight = gradient<std::uint8_t>(3);
  std::vector<std::uint16_t> sixteen;
  for (std::uint8_t x : eight) sixteen.push_back(static_cast<std::uint16_t>(x * 257));
  for (const char* kind : {"png", "tif"}) {
    const Photo a = read_photo(save(std::string("8.") + kind, 3, eight));
    const Photo b = read_photo(save(std::string("16.") + kind, 3, sixteen));
    EXPECT_EQ(a.info.bit_depth, 8);
    EXPECT_EQ(b.info.bit_depth, 16);
    for (std::size_t i = 0; i < eight.size(); ++i) {
      EXPECT_NEAR(a.pixels[i], b.pixels[i], 1e-6);
      EXPECT_NEAR(a.pixels[i], decoded(eight[i] / 255.0), 1e-6);
    }
  }
}

TEST_F(ReadPhoto, EncodedValuesAreKeptOnRequest) {
  const std::vector<std::uint8_t> eight = gradient<std::uint8_t>(3);
  const Photo photo = read_photo(save("a.png", 3, eight), false);
  for (std::size_t i = 0; i < eight.size(); ++i)
    EXPECT_FLOAT_EQ(photo.pixels[i], static_cast<float>(eight[i]) / 255);
}

TEST_F(ReadPhoto, EveryFormatIsKnownByItsContent) {
  const std::vector<std::uint8_t> eight = gradient<std::uint8_t>(3);
  const std::vector<float> floats(3 * kSize * kSize, 0.5f);
  const std::array<std::pair<const char*, FileFormat>, 5> kinds{{{"png", FileFormat::kPng},
                                                                 {"jpg", FileFormat::kJpeg},
                                                                 {"tif", FileFormat::kTiff},
                                                                 {"exr", FileFormat::kExr},
                                                                 {"hdr", FileFormat::kHdr}}};
  for (const auto& [extension, format] : kinds) {
    const std::string name = std::string("a.") + extension;
    const bool is_float = format == FileFormat::kExr || format == FileFormat::kHdr;
    const std::string file = is_float ? save(name, 3, floats) : save(name, 3, eight);
    // Any name, any extension: the content decides.
    const std::string disguised = path(std::string(extension) + ".txt");
    std::filesystem::rename(file, disguised);
    const Photo photo = read_photo(disguised);
    EXPECT_EQ(photo.info.format, format);
    EXPECT_EQ(photo.info.is_float, is_float);
    EXPECT_EQ(photo.info.width, kSize);
    EXPECT_EQ(probe_photo(disguised).channels, 3);
    if (is_float) {
      EXPECT_NEAR(photo.pixels[0], 0.5, 1e-2);
    }
  }
}

TEST_F(ReadPhoto, FloatTiffIsLinear) {
  const std::vector<float> floats(3 * kSize * kSize, 0.5f);
  EXPECT_EQ(read_photo(save("a.tif", 3, floats)).pixels, floats);
}

TEST_F(ReadPhoto, GreyIsRepeated) {
  const Photo photo = read_photo(save("a.png", 1, gradient<std::uint8_t>(1)));
  EXPECT_TRUE(photo.info.grey);
  ASSERT_EQ(photo.pixels.size(), 3u * kSize * kSize);
  EXPECT_EQ(photo.pixels[300], photo.pixels[302]);
}

TEST_F(ReadPhoto, AlphaIsNotMultipliedIn) {
  std::vector<std::uint8_t> pixels;
  for (int i = 0; i < kSize * kSize; ++i) {
    const bool hidden = i % 2;
    pixels.insert(pixels.end(), {255, 0, 0, static_cast<std::uint8_t>(hidden ? 0 : 128)});
  }
  for (const char* name : {"a.png", "a.tif"}) {
    OIIO::ImageSpec spec(kSize, kSize, 4, OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:UnassociatedAlpha", 1);
    const Photo photo = read_photo(save(name, spec, pixels));
    ASSERT_EQ(photo.alpha.size(), static_cast<std::size_t>(kSize * kSize)) << name;
    EXPECT_FLOAT_EQ(photo.alpha[0], 128.f / 255);
    EXPECT_EQ(photo.alpha[1], 0.f);
    EXPECT_EQ(photo.pixels[0], 1.f) << name;
    EXPECT_EQ(photo.pixels[3], 1.f) << "colour under alpha 0 is kept: " << name;
  }
}

// Many pictures are white where they are transparent.
TEST_F(ReadPhoto, WhatIsTransparentIsNotCalledClipped) {
  std::vector<std::uint8_t> pixels;
  for (int i = 0; i < kSize * kSize; ++i)
    pixels.insert(pixels.end(), {255, 255, 255, static_cast<std::uint8_t>(i % 4 ? 0 : 255)});
  const Photo photo = read_photo(save("a.png", 4, pixels));
  EXPECT_EQ(photo.counts[PixelUse::kClipped], kSize * kSize / 4);
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "25.0% of its pixels are clipped"));
}

TEST_F(ReadPhoto, ExrColourIsDividedByAlpha) {
  const std::vector<float> pixels{0.25f, 0.5f, 0.f, 0.5f, 2.f, 0.f, 0.f, 0.f};
  write_exr(path("a.exr"), pixels.data(), 2, 1, 4);
  const Photo photo = read_photo(path("a.exr"));
  EXPECT_EQ(photo.pixels, (std::vector<float>{0.5f, 1.f, 0.f, 2.f, 0.f, 0.f}));
  EXPECT_EQ(photo.alpha, (std::vector<float>{0.5f, 0.f}));
}

// What Cycles 3.4 writes of a transparent film.
TEST_F(ReadPhoto, AnAlphaThatIsZeroButForRoundingIsZero) {
  const std::vector<float> pixels{0.f, 0.f, 0.f, 2.2e-8f, 0.1f, 0.1f, 0.1f, 0.001f};
  write_exr(path("a.exr"), pixels.data(), 2, 1, 4);
  const Photo photo = read_photo(path("a.exr"));
  EXPECT_EQ(photo.alpha, (std::vector<float>{0.f, 0.001f}));
  EXPECT_FLOAT_EQ(photo.pixels[3], 100.f);
}

TEST_F(ReadPhoto, ClippedPixelsAreMarked) {
  std::vector<std::uint8_t> pixels(3 * kSize * kSize, 100);
  pixels[1] = 255;
  pixels[5] = 254;
  pixels[8] = 253;
  const Photo photo = read_photo(save("a.png", 3, pixels));
  EXPECT_EQ(photo.use[0], PixelUse::kClipped);
  EXPECT_EQ(photo.use[1], PixelUse::kClipped);
  EXPECT_EQ(photo.use[2], PixelUse::kCounts);
  EXPECT_EQ(photo.counts[PixelUse::kClipped], 2);
  std::vector<std::uint16_t> sixteen(3 * kSize * kSize, 65000);
  sixteen[0] = 65534;
  const Photo fine = read_photo(save("b.png", 3, sixteen));
  EXPECT_EQ(fine.use[0], PixelUse::kClipped);
  EXPECT_EQ(fine.use[1], PixelUse::kCounts);
}

TEST_F(ReadPhoto, PixelsThatAreNotFiniteOrBelowZeroAreLeftOutAndCounted) {
  std::vector<float> pixels(3 * kSize * kSize, 0.5f);
  pixels[0] = std::nanf("");
  pixels[4] = std::numeric_limits<float>::infinity();
  pixels[6] = -0.25f;
  pixels[9] = 1e9f;
  write_exr(path("a.exr"), pixels.data(), kSize, kSize, 3);
  const Photo photo = read_photo(path("a.exr"));
  EXPECT_EQ(photo.counts[PixelUse::kNotFinite], 2);
  EXPECT_EQ(photo.counts[PixelUse::kNegative], 1);
  EXPECT_EQ(photo.counts[PixelUse::kCounts], kSize * kSize - 3);
  EXPECT_EQ(photo.use[0], PixelUse::kNotFinite);
  EXPECT_EQ(photo.use[1], PixelUse::kNotFinite);
  EXPECT_EQ(photo.use[2], PixelUse::kNegative);
  EXPECT_EQ(photo.use[3], PixelUse::kCounts);
  EXPECT_EQ(photo.pixels[0], 0.f);
  EXPECT_EQ(photo.pixels[6], 0.f);
  EXPECT_EQ(photo.pixels[7], 0.5f);
  EXPECT_EQ(photo.pixels[9], 1e9f);
  ASSERT_EQ(photo.info.warnings.size(), 2u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "2 of its pixels are not finite"));
  EXPECT_TRUE(holds(photo.info.warnings[1], "1 of its pixels is below 0"));
}

// Leaving out the half of it that lies below 0 makes shadows too bright.
TEST_F(ReadPhoto, NoiseAroundZeroCounts) {
  std::mt19937 random(1);
  Normal<float> noise(0, 0.004f);
  constexpr int kSide = 64;
  std::vector<float> pixels(3 * kSide * kSide);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = (i < pixels.size() / 2 ? 0.f : 1.f) + noise(random);
  write_exr(path("a.exr"), pixels.data(), kSide, kSide, 3);
  const Photo photo = read_photo(path("a.exr"));
  EXPECT_EQ(photo.counts[PixelUse::kCounts], kSide * kSide);
  EXPECT_TRUE(photo.info.warnings.empty());
  const auto middle = photo.pixels.begin() + static_cast<std::ptrdiff_t>(pixels.size() / 2);
  const double mean = std::accumulate(photo.pixels.begin(), middle, 0.0) / (pixels.size() / 2.0);
  EXPECT_NEAR(mean, 0, 3 * 0.004 / std::sqrt(pixels.size() / 2.0));
}

// A curve says nothing of values below 0.
TEST_F(ReadPhoto, AMaskAndACurveKeepNothingBelowZero) {
  std::vector<float> pixels(3 * kSize * kSize, 0.5f);
  pixels[0] = -0.001f;
  write_exr(path("a.exr"), pixels.data(), kSize, kSize, 3);
  EXPECT_EQ(read_photo(path("a.exr")).pixels[0], -0.001f);
  EXPECT_EQ(read_photo(path("a.exr"), false).counts[PixelUse::kNegative], 1);
}

TEST_F(ReadPhoto, OrientationIsReportedAndNotApplied) {
  OIIO::ImageSpec spec(kSize, 8, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("Orientation", 6);
  const std::string file = save("a.jpg", spec, std::vector<std::uint8_t>(3 * kSize * 8, 100));
  const PictureInfo info = probe_photo(file);
  EXPECT_EQ(info.orientation, 6);
  EXPECT_EQ(info.width, kSize);
  EXPECT_EQ(info.height, 8);
  ASSERT_EQ(info.warnings.size(), 1u);
  EXPECT_TRUE(holds(info.warnings[0], "orientation"));
}

TEST_F(ReadPhoto, CmykIsTakenWithAWarning) {
  const std::string file =
      write_bytes("a.jpg", {reinterpret_cast<const char*>(kCmykJpeg.data()), kCmykJpeg.size()});
  const Photo photo = read_photo(file);
  EXPECT_TRUE(photo.info.cmyk);
  EXPECT_FALSE(photo.info.warnings.empty());
  EXPECT_NEAR(photo.pixels[0], decoded(200 / 255.0), 0.02);
}

// ---- refusals

TEST_F(ReadPhoto, TruncatedFilesAreRefused) {
  for (const char* name : {"a.jpg", "a.png", "a.tif"}) {
    const std::string file = save(name, 3, busy());
    const std::string bytes = read_bytes(name);
    EXPECT_EQ(message_of<FileError>([&] { read_photo(file); }), "")
        << name << " is good when whole";
    for (double share : {0.9, 0.6}) {
      write_bytes(name, bytes.substr(0, static_cast<std::size_t>(share * bytes.size())));
      EXPECT_NE(refusal(file), "") << name << " cut to " << share;
    }
  }
  const std::vector<float> pixels(3 * kSize * kSize, 0.5f);
  write_exr(path("a.exr"), pixels.data(), kSize, kSize, 3);
  const std::string bytes = read_bytes("a.exr");
  write_bytes("a.exr", bytes.substr(0, bytes.size() - 20));
  EXPECT_NE(refusal(path("a.exr")), "");
}

TEST_F(ReadPhoto, WhatIsNoPictureIsNamed) {
  EXPECT_TRUE(holds(refusal(write_bytes("text.png", "Dear diary")), "PNG, JPEG"));
  EXPECT_TRUE(holds(refusal(write_bytes("empty.png", "")), "is empty"));
  EXPECT_TRUE(holds(refusal(path("missing.png")), "does not exist"));
  EXPECT_TRUE(holds(refusal(folder_.string()), "is not a file"));
  EXPECT_NE(refusal(write_bytes("magic.png", "\x89PNG\r\n\x1a\n")), "");
  EXPECT_NE(refusal(write_bytes("magic.jpg", "\xff\xd8\xff")), "");
  EXPECT_NE(refusal(write_bytes("magic.exr", std::string_view("v/1\x01", 4))), "");
  EXPECT_NE(refusal(write_bytes("magic.hdr", "#?RADIANCE")), "");
  EXPECT_NE(refusal(write_bytes("magic.tif", std::string_view("II*\0", 4))), "");
}

TEST_F(ReadPhoto, OtherFormatsOfTheLibraryAreNotOpened) {  // one white pixel each
  const std::string white = "\xff\xff\xff", one = number(1, 2, false);
  const std::string none(16, '\0');
  const std::vector<std::pair<const char*, std::string>> files{
      {"a.ppm", "P6 1 1 255\n" + white},
      {"a.bmp", "BM" + number(58, 4, false) + number(0, 4, false) + number(54, 4, false) +
                    number(40, 4, false) + number(1, 4, false) + number(1, 4, false) + one +
                    number(24, 2, false) + none + none.substr(8) + white + none[0]},
      {"a.tga", none.substr(14) + '\2' + none.substr(7) + one + one + '\x18' + none[0] + white},
      {"a.gif", "GIF89a" + one + one + '\x80' + none.substr(14) + white + white + ',' +
                    none.substr(12) + one + one + none[0] + "\2\2D\1" + none[0] + ';'},
  };
  for (const auto& [name, bytes] : files)
    EXPECT_TRUE(holds(refusal(write_bytes(name, bytes)), "PNG, JPEG")) << name;
}

std::string png_header(std::uint32_t width, std::uint32_t height, char bits, char color) {
  return std::string("\x89PNG\r\n\x1a\n") +
         png_chunk("IHDR", number(width, 4, true) + number(height, 4, true) + bits + color +
                               std::string(3, '\0'));
}

TEST_F(ReadPhoto, AHugeHeaderIsRefusedBeforeMemoryIsAskedFor) {
  // 10.8 GB if it were believed; the file has a hundred bytes.
  const std::string file = write_bytes(
      "huge.png", png_header(60000, 60000, 8, 2) + png_chunk("IDAT", std::string(20, '\0')));
  EXPECT_TRUE(holds(refusal(file), "60000 x 60000"));
  EXPECT_NE(message_of<FileError>([&] { probe_photo(file); }), "");
  const std::string huger = write_bytes("huger.png", png_header(2000000000, 2000000000, 8, 2) +
                                                         png_chunk("IDAT", std::string(20, '\0')));
  EXPECT_NE(refusal(huger), "");
}

TEST_F(ReadPhoto, PaletteAndFewBitsAreRefused) {
  const std::string palette =
      write_bytes("palette.png", png_header(4, 4, 8, 3) + png_chunk("PLTE", std::string(6, '\0')) +
                                     png_chunk("IDAT", std::string(20, '\0')));
  EXPECT_TRUE(holds(refusal(palette), "palette"));
  const std::string bits =
      write_bytes("bits.png", png_header(4, 4, 1, 0) + png_chunk("IDAT", std::string(20, '\0')));
  EXPECT_TRUE(holds(refusal(bits), "8 bits"));
}

TEST_F(ReadPhoto, LayersAreRefused) {
  const std::vector<float> pixels(3, 0.5f);
  write_exr(path("layers.exr"), pixels.data(), 1, 1, 3,
            {"View Layer.Combined.R", "View Layer.Combined.G", "View Layer.Combined.B"});
  EXPECT_TRUE(holds(refusal(path("layers.exr")), "Combined.R"));
}

}  // namespace
}  // namespace selenite
