// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>

#include <cmath>

#include "image/file_error.h"
#include "image/picture_bytes.h"
#include "image/read.h"
#include "image/temporary_folder.h"
#include "image/working/working_size.h"
#include "image/write.h"

// Which picture of a file is the photo, and what in it is colour, alpha, or neither.

namespace selenite {
namespace {

constexpr int kSize = 8;
constexpr int kPixels = kSize * kSize;

class Container : public TemporaryFolder {
 protected:
  std::string tiff(const std::vector<TiffPage>& pages) {
    return write_bytes("a.tif", tiff_bytes(pages));
  }
  std::string refusal(const std::string& file) {
    const std::string read = message_of<FileError>([&] { read_photo(file); });
    EXPECT_EQ(read, message_of<FileError>([&] { probe_photo(file); })) << "known by the header";
    return read;
  }
};

std::string samples(int count, const std::vector<std::uint16_t>& pixel) {
  std::vector<std::uint16_t> all;
  for (int i = 0; i < count; ++i) all.insert(all.end(), pixel.begin(), pixel.end());
  return raw_bytes(all);
}

TiffPage page(int size = kSize, std::vector<TiffTag> further = {}) {
  return {tiff_tags(size, size, 3, 16, 2, 1, std::move(further)),
          samples(size * size, {30000, 20000, 10000})};
}

TEST_F(Container, CameraRawFilesAreRefusedByName) {
  TiffPage dng = page(kSize, {{271, 2, {'A', 'c', 'm', 'e', 0}}, {50706, 1, {1, 4, 0, 0}}});
  EXPECT_TRUE(holds(refusal(tiff({dng})), "camera raw file (DNG by Acme)"));
  const TiffPage mosaic{tiff_tags(kSize, kSize, 1, 16, 32803), samples(kPixels, {500})};
  EXPECT_TRUE(holds(refusal(tiff({mosaic})), "camera raw file (sensor data)"));
  EXPECT_TRUE(holds(refusal(tiff({page(2), mosaic})), "camera raw file"));
  const TiffPage linear{tiff_tags(kSize, kSize, 3, 16, 34892), samples(kPixels, {1, 2, 3})};
  EXPECT_TRUE(holds(refusal(tiff({linear})), "camera raw file"));
  EXPECT_TRUE(holds(refusal(write_bytes("a.cr3", std::string("\0\0\0\x18", 4) + "ftypcrx    ")),
                    "camera raw file"));
  EXPECT_TRUE(
      holds(refusal(write_bytes("a.heic", std::string("\0\0\0\x18", 4) + "ftypheic    ")), "HEIF"));
}

// As most of them are built: a preview first, and the sensor's data in a directory below it.
TEST_F(Container, ACameraRawFileIsKnownBehindItsPreview) {
  std::string file = tiff_bytes(
      {page(kSize, {{330, 4, {0}}}), {tiff_tags(4, 4, 1, 16, 32803), samples(16, {500})}});
  // The second page becomes a directory below the first one.
  const auto number_at = [&](std::size_t at, int size) {
    std::size_t value = 0;
    for (int i = 0; i < size; ++i)
      value |= std::size_t{static_cast<unsigned char>(file[at + static_cast<std::size_t>(i)])}
               << 8 * i;
    return value;
  };
  const std::size_t first = number_at(4, 4), entries = number_at(first, 2);
  const std::size_t link = first + 2 + 12 * entries;
  for (std::size_t i = 0; i < entries; ++i)
    if (const std::size_t at = first + 2 + 12 * i; number_at(at, 2) == 330)
      file.replace(at + 8, 4, file.substr(link, 4));
  file.replace(link, 4, std::string(4, '\0'));
  EXPECT_TRUE(holds(refusal(write_bytes("a.nef", file)), "camera raw file (sensor data)"));
}

TEST_F(Container, AThumbnailInFrontOfThePhotoIsRefused) {
  EXPECT_TRUE(holds(refusal(tiff({page(2, {{254, 4, {1}}}), page()})), "reduced copy of 2 x 2"));
  EXPECT_TRUE(
      holds(refusal(tiff({page(2), page()})), "8 x 8 pixels behind the first one of 2 x 2"));
}

TEST_F(Container, FurtherPagesAreNamed) {
  const PictureInfo two = probe_photo(tiff({page(), page()}));
  ASSERT_EQ(two.warnings.size(), 1u);
  EXPECT_TRUE(holds(two.warnings[0], "2 pages"));
  EXPECT_TRUE(probe_photo(tiff({page(), page(2, {{254, 4, {1}}})})).warnings.empty());
}

TEST_F(Container, AnExtraSampleWithoutMeaningIsNoAlpha) {
  const TiffPage infrared{tiff_tags(kSize, kSize, 4, 16, 2, 1, {{338, 3, {0}}}),
                          samples(kPixels, {30000, 20000, 10000, 5})};
  const Photo photo = read_photo(tiff({infrared}));
  EXPECT_TRUE(photo.alpha.empty());
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "sample 4"));
}

TEST_F(Container, AssociatedAlphaIsDividedOut) {
  const std::vector<TiffTag> associated{{338, 3, {1}}}, straight{{338, 3, {2}}};
  const Photo plain = read_photo(tiff({page()}));
  const TiffPage half{tiff_tags(kSize, kSize, 4, 16, 2, 1, associated),
                      samples(kPixels, {15000, 10000, 5000, 32768})};
  const Photo multiplied = read_photo(tiff({half}));
  const TiffPage as_is{tiff_tags(kSize, kSize, 4, 16, 2, 1, straight),
                       samples(kPixels, {30000, 20000, 10000, 32768})};
  const Photo not_multiplied = read_photo(tiff({as_is}));
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(multiplied.pixels[c], plain.pixels[c], 2e-4);
    EXPECT_EQ(not_multiplied.pixels[c], plain.pixels[c]);
  }
  EXPECT_NEAR(multiplied.alpha[0], 0.5, 1e-4);
  EXPECT_NEAR(not_multiplied.alpha[0], 0.5, 1e-4);
  std::vector<float> floats;
  for (int i = 0; i < kPixels; ++i) floats.insert(floats.end(), {0.25f, 0.125f, 0.0625f, 0.5f});
  const Photo floating =
      read_photo(tiff({{tiff_tags(kSize, kSize, 4, 32, 2, 3, associated), raw_bytes(floats)}}));
  EXPECT_FLOAT_EQ(floating.pixels[0], 0.5f);
  EXPECT_FLOAT_EQ(floating.pixels[2], 0.125f);
}

TEST_F(Container, WhatIsNoPhotoOfEightBitsIsRefused) {
  const TiffPage bilevel{tiff_tags(kSize, kSize, 1, 1, 1), std::string(kSize, '\x55')};
  EXPECT_TRUE(holds(refusal(tiff({bilevel})), "fewer than 8 bits"));
  TiffPage unsaid = bilevel;  // BitsPerSample left out means 1
  std::erase_if(unsaid.tags, [](const TiffTag& tag) { return tag.tag == 258; });
  EXPECT_TRUE(holds(refusal(tiff({unsaid})), "fewer than 8 bits"));
  const TiffPage palette{tiff_tags(kSize, kSize, 1, 8, 3), std::string(kPixels, '\1')};
  EXPECT_TRUE(holds(refusal(tiff({palette})), "palette"));
  const TiffPage lab{tiff_tags(kSize, kSize, 3, 8, 8), std::string(3 * kPixels, '\1')};
  EXPECT_TRUE(holds(refusal(tiff({lab})), "Lab"));
  const TiffPage whole{tiff_tags(kSize, kSize, 3, 32, 2), std::string(12 * kPixels, '\1')};
  EXPECT_TRUE(holds(refusal(tiff({whole})), "32-bit numbers"));
  const TiffPage with_sign{tiff_tags(kSize, kSize, 3, 16, 2, 2), std::string(6 * kPixels, '\1')};
  EXPECT_TRUE(holds(refusal(tiff({with_sign})), "sample format 2"));
}

TEST_F(Container, CmykIsTakenWithAWarning) {
  std::string pixels;
  for (int i = 0; i < kPixels; ++i) pixels += std::string("\x37\x9b\xcd\x00", 4);
  const Photo photo = read_photo(tiff({{tiff_tags(kSize, kSize, 4, 8, 5), pixels}}));
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "CMYK"));
  EXPECT_NEAR(photo.pixels[0], std::pow((200 / 255. + 0.055) / 1.055, 2.4), 0.01);
}

// ---- OpenEXR

class ExrContainer : public Container {
 protected:
  struct Part {
    std::string name;
    std::vector<std::string> channels;
  };
  std::string parts(const std::vector<Part>& wanted) {
    std::vector<OIIO::ImageSpec> specs;
    for (const Part& part : wanted) {
      OIIO::ImageSpec spec(kSize, kSize, static_cast<int>(part.channels.size()),
                           OIIO::TypeDesc::FLOAT);
      spec.channelnames = part.channels;
      spec.attribute("name", part.name);
      specs.push_back(spec);
    }
    const auto out = OIIO::ImageOutput::create("a.exr");
    EXPECT_TRUE(out->open(path("a.exr"), static_cast<int>(specs.size()), specs.data()));
    for (std::size_t i = 0; i < specs.size(); ++i) {
      if (i > 0) {
        EXPECT_TRUE(out->open(path("a.exr"), specs[i], OIIO::ImageOutput::AppendSubimage));
      }
      std::vector<float> pixels(wanted[i].channels.size() * kPixels,
                                0.25f * static_cast<float>(i + 1));
      EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    }
    out->close();
    return path("a.exr");
  }
  std::string window(const OIIO::ImageSpec& spec) {
    std::vector<float> pixels;
    for (int i = 0; i < spec.width * spec.height; ++i)
      pixels.insert(pixels.end(), 3, 0.01f * static_cast<float>(i + 1));
    const auto out = OIIO::ImageOutput::create("a.exr");
    EXPECT_TRUE(out->open(path("a.exr"), spec));
    EXPECT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    out->close();
    return path("a.exr");
  }
};

TEST_F(ExrContainer, ThePartWithColoursIsRead) {
  const Photo photo = read_photo(parts({{"depth", {"Z"}}, {"beauty", {"R", "G", "B"}}}));
  EXPECT_EQ(photo.pixels[0], 0.5f);
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "'beauty' is read"));
}

TEST_F(ExrContainer, SeveralPicturesAreRefused) {
  const std::string text =
      refusal(parts({{"diffuse", {"R", "G", "B"}}, {"beauty", {"R", "G", "B"}}}));
  EXPECT_TRUE(holds(text, "'diffuse', 'beauty'")) << text;
}

TEST_F(ExrContainer, LuminanceAndChromaAreRefusedByName) {
  EXPECT_TRUE(holds(refusal(parts({{"", {"Y", "RY", "BY"}}})), "luminance and chroma"));
}

TEST_F(ExrContainer, FurtherChannelsAreNamed) {
  const Photo photo = read_photo(parts({{"", {"R", "G", "B", "Z"}}}));
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "not read: Z"));
}

// OpenEXR reads a value by its type alone. What it takes for the next one may ask for any memory.
TEST_F(ExrContainer, AValueOfAnotherSizeThanItsTypeIsDamage) {
  const std::string whole = (parts({{"", {"R", "G", "B"}}}), read_bytes("a.exr"));
  const auto with_size = [&](const std::string& attribute, int size) {
    std::string bytes = whole;
    bytes.replace(bytes.find(attribute) + attribute.size(), 4,
                  number(static_cast<std::uint64_t>(size), 4, false));
    return refusal(write_bytes("b.exr", bytes));
  };
  using namespace std::string_literals;
  const std::string order = "lineOrder\0lineOrder\0"s, channels = "channels\0chlist\0"s;
  EXPECT_EQ(with_size(order, 1), "");
  EXPECT_TRUE(holds(with_size(order, 0), "damaged OpenEXR header"));
  EXPECT_EQ(with_size(channels, 3 * 18 + 1), "");
  EXPECT_TRUE(holds(with_size(channels, 3 * 18), "damaged OpenEXR header"));
  // A thumbnail, which takes four bytes a pixel.
  const auto with_preview = [&](int width, int bytes) {
    std::string file = whole;
    file.insert(file.find(order), "preview\0preview\0"s + number(8 + bytes, 4, false) +
                                      number(width, 4, false) + number(2, 4, false) +
                                      std::string(bytes, 'p'));
    write_bytes("b.exr", file);  // its pixels stand elsewhere now
    return message_of<FileError>([&] { probe_photo(path("b.exr")); });
  };
  EXPECT_EQ(with_preview(2, 16), "");
  EXPECT_TRUE(holds(with_preview(20000, 16), "damaged OpenEXR header"));
}

TEST_F(ExrContainer, TheFrameIsTheDisplayWindow) {
  OIIO::ImageSpec spec(4, 4, 3, OIIO::TypeDesc::FLOAT);
  spec.x = 2;
  spec.y = 1;
  spec.full_width = spec.full_height = kSize;
  const Photo crop = read_photo(window(spec));
  EXPECT_EQ(crop.info.width, kSize);
  EXPECT_EQ(crop.counts[PixelUse::kOutsideFile], kPixels - 16);
  EXPECT_EQ(crop.use[kSize + 2], PixelUse::kCounts);
  EXPECT_FLOAT_EQ(crop.pixels[3 * (kSize + 2)], 0.01f);
  EXPECT_FLOAT_EQ(crop.pixels[3 * (2 * kSize + 2)], 0.05f);
  EXPECT_EQ(crop.use[0], PixelUse::kOutsideFile);
  ASSERT_EQ(crop.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(crop.info.warnings[0], "4 x 4 pixels of a frame of 8 x 8"));

  OIIO::ImageSpec wide(6, 6, 3, OIIO::TypeDesc::FLOAT);  // overscan of one pixel
  wide.x = wide.y = -1;
  wide.full_width = wide.full_height = 4;
  const Photo inner = read_photo(window(wide));
  EXPECT_EQ(inner.info.width, 4);
  EXPECT_FLOAT_EQ(inner.pixels[0], 0.08f);
  EXPECT_TRUE(inner.info.warnings.empty());
}

// ---- limits

TEST_F(Container, HugeHeadersAreRefusedBeforeMemoryIsAskedFor) {
  const std::vector<float> pixels(3 * kPixels, 0.5f);
  write_exr(path("a.exr"), pixels.data(), kSize, kSize, 3);
  std::string bytes = read_bytes("a.exr");
  const std::size_t at = bytes.find("dataWindow") + std::strlen("dataWindow") + 1 + 6 + 4;
  bytes.replace(at, 16, number(0, 8, false) + number(49'999'999, 4, false) + number(7, 4, false));
  EXPECT_TRUE(holds(refusal(write_bytes("wide.exr", bytes)), "50000000 x 8"));
  EXPECT_TRUE(holds(refusal(tiff({{tiff_tags(60000, 60000, 3, 16, 2), "abc"}})), "60000 x 60000"));
  EXPECT_TRUE(holds(refusal(write_bytes("a.hdr",
                                        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"
                                        "-Y 60000 +X 60000\nabc")),
                    "60000 x 60000"));
  const std::string progressive = std::string("\xff\xd8\xff\xc2\0\x11\x08\xff\xff\xff\xff\3", 12) +
                                  std::string("\1\x11\0\2\x11\0\3\x11\0", 9) + "\xff\xda";
  EXPECT_TRUE(holds(refusal(write_bytes("a.jpg", progressive)), "65535 x 65535"));
  // Few enough pixels, and too many bytes.
  EXPECT_TRUE(
      holds(refusal(tiff({{tiff_tags(13000, 13000, 3, 32, 2, 3), "abc"}})), "2028 megabytes"));
}

}  // namespace
}  // namespace selenite
