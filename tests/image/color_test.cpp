// SPDX-License-Identifier: GPL-3.0-or-later
#include <OpenImageIO/imageio.h>

#include <cmath>

#include "image/file_error.h"
#include "image/header/file_view.h"
#include "image/picture_bytes.h"
#include "image/read.h"
#include "image/temporary_folder.h"
#include "image/write.h"

// What a file says of its colours. A linear Rec. 709 colour is encoded by published matrices and
// curves, and has to come back.

namespace selenite {
namespace {

using Color = std::array<double, 3>;
using Rows = std::array<Color, 3>;

constexpr int kSize = 4;
constexpr Color kTruth{0.6, 0.3, 0.15};

// From linear Rec. 709. Sources: Adobe RGB (1998) Color Image Encoding, annex B; Display P3 and
// Rec. 2020 as in ITU-R BT.2087 and Apple's profile; all with D65.
constexpr Rows kToAdobe{{{0.71512, 0.28488, 0}, {0, 1, 0}, {0, 0.04116, 0.95884}}};
constexpr Rows kToP3{{{0.82246, 0.17754, 0}, {0.03319, 0.96681, 0}, {0.01708, 0.07240, 0.91052}}};
constexpr Rows kTo2020{
    {{0.62740, 0.32930, 0.04330}, {0.06910, 0.91950, 0.01140}, {0.01640, 0.08800, 0.89560}}};
// To XYZ with white D65. Source: IEC 61966-2-1.
constexpr Rows kToXyz{
    {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}};
// Colorants adapted to D50, as profiles hold them.
constexpr Rows kSrgbColorants{
    {{0.43607, 0.22249, 0.01392}, {0.38515, 0.71687, 0.09708}, {0.14307, 0.06061, 0.71410}}};
constexpr Rows kAdobeColorants{
    {{0.60974, 0.31111, 0.01947}, {0.20528, 0.62567, 0.06087}, {0.14919, 0.06322, 0.74457}}};
constexpr Rows kP3Colorants{
    {{0.51512, 0.24120, -0.00105}, {0.29198, 0.69225, 0.04189}, {0.15710, 0.06657, 0.78407}}};

Color times(const Rows& rows, const Color& v) {
  Color result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) result[i] += rows[i][k] * v[k];
  return result;
}

template <class Curve>
Color each(const Color& v, Curve curve) {
  return {curve(v[0]), curve(v[1]), curve(v[2])};
}

double to_srgb(double x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

std::vector<IccTag> matrix_profile(const Rows& colorants, const std::string& curve) {
  return {{"rXYZ", icc_xyz(colorants[0])},
          {"gXYZ", icc_xyz(colorants[1])},
          {"bXYZ", icc_xyz(colorants[2])},
          {"rTRC", curve},
          {"gTRC", curve},
          {"bTRC", curve}};
}

Color in_adobe_rgb(const Color& v) {
  return each(times(kToAdobe, v), [](double x) { return std::pow(x, 256. / 563); });
}

std::string profile_chunk(const std::string& profile) {
  return png_chunk("iCCP", std::string("icc\0\0", 5) + stored(profile));
}

std::string hundred_thousandths(const std::vector<double>& values) {
  std::string text;
  for (const double value : values)
    text += number(static_cast<std::uint64_t>(std::lround(value * 100000)), 4, true);
  return text;
}

class PhotoColor : public TemporaryFolder {
 protected:
  void expect(const std::string& file, const Color& truth = kTruth, double tolerance = 2e-3) {
    const Photo photo = read_photo(file);
    for (std::size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(photo.pixels[c], truth[c], tolerance * truth[0]) << file << " channel " << c;
    EXPECT_EQ(photo.use[0], PixelUse::kCounts);
  }
  std::string png(const std::string& name, const Color& encoded, const std::string& chunks = "") {
    return write_bytes(name, png_bytes(kSize, kSize, encoded, chunks));
  }
  std::string with_profile(const std::string& name, const Color& encoded,
                           const std::string& profile) {
    return png(name, encoded, profile_chunk(profile));
  }
  /// `segments`: what stands in front of the encoder's own.
  std::string jpeg(const char* name, const Color& encoded, const std::string& segments) {
    OIIO::ImageSpec spec(16, 16, 3, OIIO::TypeDesc::UINT8);
    spec.attribute("Compression", "jpeg:100");
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 256; ++i)
      for (const double x : encoded) pixels.push_back(static_cast<std::uint8_t>(x * 255 + 0.5));
    const auto out = OIIO::ImageOutput::create(name);
    EXPECT_TRUE(out->open(path(name), spec) &&
                out->write_image(OIIO::TypeDesc::UINT8, pixels.data()));
    out->close();
    const std::string bytes = read_bytes(name);
    return write_bytes(name, bytes.substr(0, 2) + segments + bytes.substr(2));
  }
  std::string refusal(const std::string& file) {
    return message_of<FileError>([&] { read_photo(file); });
  }
  std::string radiance(const std::string& name, const std::string& header, const Color& value) {
    // One exponent for all channels: value * 256 / 2^e as bytes. Source: Ward 1991.
    int exponent = 0;
    std::frexp(std::max({value[0], value[1], value[2]}), &exponent);
    std::string pixel;
    for (const double x : value) pixel += static_cast<char>(std::ldexp(x, 8 - exponent));
    pixel += static_cast<char>(exponent + 128);
    std::string pixels;
    for (int i = 0; i < kSize * kSize; ++i) pixels += pixel;
    return write_bytes(name, "#?RADIANCE\n" + header + "\n-Y 4 +X 4\n" + pixels);
  }
};

// ---- ICC

TEST_F(PhotoColor, ProfilesOfMatrixAndCurveAreConverted) {
  expect(with_profile(
      "adobe.png", in_adobe_rgb(kTruth),
      icc_bytes("RGB ", "XYZ ", matrix_profile(kAdobeColorants, icc_gamma(563. / 256)))));
  expect(with_profile(
      "p3.png", each(times(kToP3, kTruth), to_srgb),
      icc_bytes("RGB ", "XYZ ", matrix_profile(kP3Colorants, icc_parametric_srgb()), 4)));
  expect(with_profile("linear.png", kTruth,
                      icc_bytes("RGB ", "XYZ ", matrix_profile(kSrgbColorants, icc_gamma(1)))));
  std::vector<double> table;
  for (int i = 0; i < 1024; ++i) table.push_back(std::pow(i / 1023., 1.8));
  expect(with_profile("table.png", each(kTruth, [](double x) { return std::pow(x, 1 / 1.8); }),
                      icc_bytes("RGB ", "XYZ ", matrix_profile(kSrgbColorants, icc_table(table)))));
}

// As a segment holds 64 kB.
TEST_F(PhotoColor, AProfileInPiecesIsJoined) {
  const std::string profile =
      icc_bytes("RGB ", "XYZ ", matrix_profile(kAdobeColorants, icc_gamma(563. / 256)));
  const auto segments = [&](const std::vector<std::size_t>& order) {
    std::string text;
    for (const std::size_t i : order)  // 200 bytes each, the last one what is left
      text += jpeg_segment('\xe2', std::string("ICC_PROFILE\0", 12) + number(i + 1, 1, true) +
                                       number(3, 1, true) +
                                       profile.substr(200 * i, i < 2 ? 200 : std::string::npos));
    return text;
  };
  expect(jpeg("pieces.jpg", in_adobe_rgb(kTruth), segments({0, 1, 2})), kTruth, 0.02);
  expect(jpeg("mixed.jpg", in_adobe_rgb(kTruth), segments({2, 0, 1})), kTruth, 0.02);
  EXPECT_TRUE(holds(refusal(jpeg("lost.jpg", in_adobe_rgb(kTruth), segments({0, 2}))), "damaged"));
}

TEST_F(PhotoColor, WhiteStaysWhiteInEveryProfile) {
  for (const Rows& colorants : {kSrgbColorants, kAdobeColorants, kP3Colorants})
    expect(with_profile("white.png", {0.5, 0.5, 0.5},
                        icc_bytes("RGB ", "XYZ ", matrix_profile(colorants, icc_gamma(1)))),
           {0.5, 0.5, 0.5});
}

TEST_F(PhotoColor, AGreyProfileGivesItsCurve) {
  OIIO::ImageSpec spec(kSize, kSize, 1, OIIO::TypeDesc::UINT16);
  const std::string profile = icc_bytes("GRAY", "XYZ ", {{"kTRC", icc_gamma(1.8)}});
  spec.attribute("ICCProfile",
                 OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                 profile.data());
  const auto out = OIIO::ImageOutput::create("grey.tif");
  ASSERT_TRUE(out->open(path("grey.tif"), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT16,
                               std::vector<std::uint16_t>(kSize * kSize, 32768).data()));
  out->close();
  const double grey = std::pow(32768 / 65535., 1.8);
  expect(path("grey.tif"), {grey, grey, grey});
}

TEST_F(PhotoColor, OtherProfilesAreRefusedByName) {
  const auto with = [&](const std::string& profile) {
    return refusal(with_profile("a.png", {0.5, 0.5, 0.5}, profile));
  };
  std::vector<IccTag> lut = matrix_profile(kSrgbColorants, icc_gamma(1));
  lut.push_back({"A2B0", std::string("mft2\0\0\0\0", 8) + std::string(64, '\0')});
  EXPECT_TRUE(
      holds(with(icc_bytes("RGB ", "XYZ ", lut)), "'Test profile', which maps colours by a table"));
  EXPECT_TRUE(holds(with(icc_bytes("RGB ", "Lab ", matrix_profile(kSrgbColorants, icc_gamma(1)))),
                    "connects by Lab"));
  std::vector<IccTag> bare = matrix_profile(kSrgbColorants, icc_gamma(1));
  bare.erase(bare.begin() + 4);  // gTRC
  EXPECT_TRUE(holds(with(icc_bytes("RGB ", "XYZ ", bare)), "lacks the curve gTRC"));
  const Rows flat{{{0.3, 0.3, 0.3}, {0.3, 0.3, 0.3}, {0.3, 0.3, 0.3}}};
  EXPECT_TRUE(holds(with(icc_bytes("RGB ", "XYZ ", matrix_profile(flat, icc_gamma(1)))),
                    "cannot be inverted"));
}

TEST_F(PhotoColor, AProfileThatPointsOutsideItselfIsRefusedBeforeItIsDecoded) {
  const std::string good =
      icc_bytes("RGB ", "XYZ ", matrix_profile(kSrgbColorants, icc_gamma(1)), 4);
  expect(with_profile("good.png", kTruth, good));
  const std::size_t first = 128 + 4;  // the entry of "desc": name, offset, size
  std::string outside = good, short_text = good, long_text = good;
  outside.replace(first + 4, 4, number(good.size() - 8, 4, true));
  const std::size_t text = whole_number(good.data() + first + 4, 4, true);
  long_text.replace(text + 20, 4, number(1 << 20, 4, true));
  short_text.replace(first + 8, 4, number(2, 4, true));
  for (const std::string& bad : {outside, long_text, short_text, good.substr(0, 130)})
    EXPECT_TRUE(holds(refusal(with_profile("bad.png", kTruth, bad)), "profile that is damaged"));
  const std::vector<std::uint32_t> bytes(long_text.begin(), long_text.end());
  std::vector<std::uint32_t> values;
  for (const std::uint32_t byte : bytes) values.push_back(byte & 255);
  const std::vector<std::uint16_t> pixels(3 * kSize * kSize, 30000);
  const std::string tiff =
      tiff_bytes({{tiff_tags(kSize, kSize, 3, 16, 2, 1, {{34675, 7, values}}), raw_bytes(pixels)}});
  EXPECT_TRUE(holds(refusal(write_bytes("bad.tif", tiff)), "profile that is damaged"));
}

TEST_F(PhotoColor, AFloatTiffWithAProfileFollowsItsCurve) {
  OIIO::ImageSpec spec(kSize, kSize, 3, OIIO::TypeDesc::FLOAT);
  const std::string profile =
      icc_bytes("RGB ", "XYZ ", matrix_profile(kSrgbColorants, icc_parametric_srgb()), 4);
  spec.attribute("ICCProfile",
                 OIIO::TypeDesc(OIIO::TypeDesc::UINT8, static_cast<int>(profile.size())),
                 profile.data());
  std::vector<float> pixels;
  for (int i = 0; i < kSize * kSize; ++i)
    for (const double x : kTruth) pixels.push_back(static_cast<float>(to_srgb(x)));
  const auto out = OIIO::ImageOutput::create("a.tif");
  ASSERT_TRUE(out->open(path("a.tif"), spec));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
  out->close();
  expect(path("a.tif"));
}

// ---- PNG

TEST_F(PhotoColor, ChunksOfPngHaveTheirOrder) {
  const Color srgb = each(kTruth, to_srgb);
  const std::string gamma1 = png_chunk("gAMA", hundred_thousandths({1}));
  const std::string srgb_chunk = png_chunk("sRGB", std::string(1, '\0'));
  const std::string linear =
      profile_chunk(icc_bytes("RGB ", "XYZ ", matrix_profile(kSrgbColorants, icc_gamma(1))));
  const std::string code_2020 = png_chunk("cICP", std::string("\x09\x08\x00\x01", 4));
  expect(png("plain.png", srgb));
  expect(png("srgb.png", srgb, srgb_chunk));
  expect(png("gamma.png", kTruth, gamma1));
  expect(png("gamma18.png", each(kTruth, [](double x) { return std::pow(x, 1 / 1.8); }),
             png_chunk("gAMA", hundred_thousandths({1 / 1.8}))));
  expect(png("srgb_over_gamma.png", srgb, gamma1 + srgb_chunk));
  expect(png("profile_over_gamma.png", kTruth,
             png_chunk("gAMA", hundred_thousandths({0.45455})) + linear));
  expect(png("code_over_all.png", times(kTo2020, kTruth), code_2020 + linear + gamma1));
}

TEST_F(PhotoColor, PrimariesOfPngAreConverted) {
  const std::string adobe =
      hundred_thousandths({0.3127, 0.3290, 0.64, 0.33, 0.21, 0.71, 0.15, 0.06});
  expect(png("adobe.png",
             each(times(kToAdobe, kTruth), [](double x) { return std::pow(x, 1 / 2.2); }),
             png_chunk("gAMA", hundred_thousandths({1 / 2.2})) + png_chunk("cHRM", adobe)));
  // What programs write for sRGB that do not write the chunk sRGB
  const std::string rec709 =
      hundred_thousandths({0.3127, 0.3290, 0.64, 0.33, 0.30, 0.60, 0.15, 0.06});
  expect(png("srgb.png", each(kTruth, to_srgb),
             png_chunk("gAMA", hundred_thousandths({0.45455})) + png_chunk("cHRM", rec709)));
  expect(png("p3.png", each(times(kToP3, kTruth), to_srgb),
             png_chunk("cICP", std::string("\x0c\x0d\x00\x01", 4))));
}

TEST_F(PhotoColor, VideoCurvesAreRefusedByName) {
  EXPECT_TRUE(
      holds(refusal(png("pq.png", kTruth, png_chunk("cICP", std::string("\x09\x10\x00\x01", 4)))),
            "(PQ)"));
  EXPECT_TRUE(
      holds(refusal(png("hlg.png", kTruth, png_chunk("cICP", std::string("\x09\x12\x00\x01", 4)))),
            "(HLG)"));
  EXPECT_NE(
      refusal(png("narrow.png", kTruth, png_chunk("cICP", std::string("\x01\x0d\x00\x00", 4)))),
      "");
}

TEST_F(PhotoColor, ColoursOutsideRec709AreLeftOutAndCounted) {
  const Photo photo = read_photo(
      png("green.png", {0.05, 0.9, 0.05}, png_chunk("cICP", std::string("\x09\x08\x00\x01", 4))));
  EXPECT_EQ(photo.counts[PixelUse::kOutsideGamut], kSize * kSize);
  ASSERT_EQ(photo.info.warnings.size(), 1u);
  EXPECT_TRUE(holds(photo.info.warnings[0], "outside the colours of Rec. 709"));
  // As far as eight bits round, a colour at the rim is inside: red of Rec. 709 in Rec. 2020.
  expect(png("red.png", {0.6274 * 0.6, 0.0691 * 0.6 - 0.0005, 0.0164 * 0.6},
             png_chunk("cICP", std::string("\x09\x08\x00\x01", 4))),
         {0.6, 0, 0}, 0.01);
}

// ---- Exif

std::string exif_block(int color_space, const std::string& interoperability) {
  // IFD0 at 8 -> Exif at 26 -> interoperability at 56
  const auto entry = [](int tag, int type, std::uint64_t count, const std::string& value) {
    return number(tag, 2, false) + number(type, 2, false) + number(count, 4, false) + value;
  };
  const std::string end(4, '\0');
  return std::string("II*\0", 4) + number(8, 4, false) + number(1, 2, false) +
         entry(0x8769, 4, 1, number(26, 4, false)) + end + number(2, 2, false) +
         entry(0xa001, 3, 1, number(color_space, 4, false)) +
         entry(0xa005, 4, 1, number(56, 4, false)) + end + number(1, 2, false) +
         entry(1, 2, 4, interoperability + '\0') + end;
}

TEST_F(PhotoColor, ExifSaysAdobeRgb) {
  const auto with_exif = [&](const char* name, const Color& encoded, const std::string& block) {
    return jpeg(name, encoded, jpeg_segment('\xe1', std::string("Exif\0\0", 6) + block));
  };
  expect(with_exif("adobe.jpg", in_adobe_rgb(kTruth), exif_block(65535, "R03")), kTruth, 0.02);
  const Color srgb = each(kTruth, to_srgb);
  expect(with_exif("srgb.jpg", srgb, exif_block(1, "R98")), kTruth, 0.02);
  const std::string unknown = with_exif("unknown.jpg", srgb, exif_block(65535, "THM"));
  expect(unknown, kTruth, 0.02);
  ASSERT_EQ(probe_photo(unknown).warnings.size(), 1u);
  EXPECT_TRUE(holds(probe_photo(unknown).warnings[0], "uncalibrated"));
}

// ---- OpenEXR and Radiance

TEST_F(PhotoColor, ChromaticitiesOfExrAreConverted) {
  const auto exr = [&](const char* name, const Color& value, std::vector<float> chromaticities) {
    OIIO::ImageSpec spec(kSize, kSize, 3, OIIO::TypeDesc::FLOAT);
    if (!chromaticities.empty())
      spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8),
                     chromaticities.data());
    std::vector<float> pixels;
    for (int i = 0; i < kSize * kSize; ++i)
      for (const double x : value) pixels.push_back(static_cast<float>(x));
    const auto out = OIIO::ImageOutput::create(name);
    EXPECT_TRUE(out->open(path(name), spec) &&
                out->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    out->close();
    return path(name);
  };
  expect(exr("plain.exr", kTruth, {}));
  expect(exr("rec709.exr", kTruth, {0.64f, 0.33f, 0.3f, 0.6f, 0.15f, 0.06f, 0.3127f, 0.329f}));
  expect(exr("rec2020.exr", times(kTo2020, kTruth),
             {0.708f, 0.292f, 0.17f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.329f}));
  // ACEScg to Rec. 709 with the white adapted by Bradford. Source: ACES, TB-2014-004 and CTL
  // utilities; the rows add up to 1, so grey stays grey.
  const Rows acescg{{{0.6131, 0.3395, 0.0474}, {0.0702, 0.9164, 0.0134}, {0.0206, 0.1096, 0.8698}}};
  const std::string file = exr("acescg.exr", times(acescg, kTruth),
                               {0.713f, 0.293f, 0.165f, 0.83f, 0.128f, 0.044f, 0.32168f, 0.33767f});
  expect(file);
  ASSERT_EQ(probe_photo(file).warnings.size(), 1u);
  EXPECT_TRUE(holds(probe_photo(file).warnings[0], "adapted"));
}

TEST_F(PhotoColor, RadianceHeaderIsObeyed) {
  const Color value{0.5, 0.25, 0.125};  // exact in bytes
  const std::string format = "FORMAT=32-bit_rle_rgbe\n";
  expect(radiance("plain.hdr", format, value), value);
  expect(radiance("exposure.hdr", format + "EXPOSURE=4\nEXPOSURE=0.5\n", value),
         {0.25, 0.125, 0.0625});
  expect(radiance("corrected.hdr", format + "COLORCORR=2 1 0.5\n", value), {0.25, 0.25, 0.25});
  expect(radiance("primaries.hdr", format + "PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n", value),
         value);
  expect(radiance("xyz.hdr", "FORMAT=32-bit_rle_xyze\n", times(kToXyz, kTruth)), kTruth, 0.02);
  EXPECT_TRUE(holds(refusal(radiance("zero.hdr", format + "EXPOSURE=0\n", value)), "EXPOSURE"));
  EXPECT_TRUE(holds(refusal(radiance("gamma.hdr", format + "GAMMA=2.2\n", value)), "GAMMA=2.2"));
}

TEST_F(PhotoColor, RadianceScanlinesMayRunInEightDirections) {
  // A gradient along x and y; byte at (x, y) is 10 + 40 x + 9 y, in a picture 3 wide and 2 high.
  const auto value = [](int x, int y) { return 10 + 40 * x + 9 * y; };
  for (const bool columns : {false, true})
    for (const bool left : {false, true})
      for (const bool up : {false, true}) {  // up: the first scanline is the lowest
        std::string pixels;
        for (int line = 0; line < (columns ? 3 : 2); ++line)
          for (int i = 0; i < (columns ? 2 : 3); ++i) {
            const int a = columns ? line : i, b = columns ? i : line;
            const int x = left ? 2 - a : a, y = up ? 1 - b : b;
            const auto byte = static_cast<char>(value(x, y));
            pixels += std::string(3, byte) + static_cast<char>(128);
          }
        const std::string x_axis = std::string(left ? "-" : "+") + "X 3";
        const std::string y_axis = std::string(up ? "+" : "-") + "Y 2";
        const std::string order = columns ? x_axis + " " + y_axis : y_axis + " " + x_axis;
        const Photo photo = read_photo(
            write_bytes("a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + order + "\n" + pixels));
        ASSERT_EQ(photo.info.width, 3) << order;
        for (int y = 0; y < 2; ++y)
          for (int x = 0; x < 3; ++x)
            EXPECT_NEAR(photo.pixels[static_cast<std::size_t>(3 * (3 * y + x))], value(x, y) / 256.,
                        3e-3)
                << order << " at " << x << ", " << y;
      }
}

}  // namespace
}  // namespace selenite
