// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/color/encoding.h"

#include <cmath>
#include <optional>

#include "image/color/icc_profile.h"
#include "image/file_error.h"
#include "math/error.h"

namespace selenite {
namespace {

constexpr const char* kCure = "export it as sRGB, or as linear floats";

ColorEncoding srgb() {
  ColorEncoding result{.name = "sRGB"};
  result.curves.fill(srgb_curve());
  return result;
}

ColorEncoding linear() { return {.name = "linear Rec. 709"}; }

std::string short_number(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

/// Primaries other than Rec. 709's, with their white made neutral.
void convert_primaries(ColorEncoding& encoding, const Primaries& primaries,
                       const Chromaticity& neutral, const std::string& name) {
  if (nearly_equal(primaries, kRec709) && nearly_equal(neutral, kD65)) return;
  encoding.to_rec709 = to_rec709(primaries, neutral);
  encoding.name += ", " + name;
  if (!nearly_equal(neutral, kD65))
    encoding.warnings.push_back(
        "its white is at x " + short_number(neutral.x) + ", y " + short_number(neutral.y) + " (" +
        name + "); colours are adapted to the white of Rec. 709, so that its grey stays grey");
}

// ---- ICC

ColorEncoding from_profile(const std::string& path, const Contents& contents, bool grey) {
  const IccProfile profile = read_icc_profile(path, contents.icc_profile);
  ColorEncoding result{.name = "profile '" + profile.name + "'"};
  if (contents.cmyk)
    refuse(path, "is CMYK, but its colour profile '" + profile.name + "' is not", kCure);
  if (profile.grey && !grey)
    refuse(path, "has colours, but its colour profile '" + profile.name + "' is for grey pictures",
           kCure);
  result.curves = profile.curves;
  if (grey && !profile.grey) result.curves.fill(profile.curves[1]);  // its grey axis
  if (!grey) result.to_rec709 = profile.to_rec709;
  return result;
}

// ---- PNG

/// Of ITU-T H.273, table 2.
std::optional<Primaries> primaries_of_code(int code) {
  constexpr Chromaticity kC{0.310, 0.316}, kDci{0.314, 0.351};
  switch (code) {
    case 1:
      return kRec709;
    case 4:
      return Primaries{{0.67, 0.33}, {0.21, 0.71}, {0.14, 0.08}, kC};
    case 5:
      return Primaries{{0.64, 0.33}, {0.29, 0.60}, {0.15, 0.06}, kD65};
    case 6:
    case 7:
      return Primaries{{0.630, 0.340}, {0.310, 0.595}, {0.155, 0.070}, kD65};
    case 9:
      return Primaries{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kD65};
    case 11:
      return Primaries{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, kDci};
    case 12:
      return Primaries{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, kD65};
    default:
      return std::nullopt;
  }
}

/// Of ITU-T H.273, table 3; PQ, HLG and logarithmic ones have no relation to this scene's light.
std::optional<TransferCurve> curve_of_code(int code) {
  switch (code) {
    case 1:
    case 6:
    case 14:
    case 15:
      return bt709_curve();
    case 4:
      return power_curve(2.2);
    case 5:
      return power_curve(2.8);
    case 8:
      return TransferCurve{};
    case 13:
      return srgb_curve();
    default:
      return std::nullopt;
  }
}

ColorEncoding from_code_points(const std::string& path, const std::array<int, 4>& code) {
  const auto primaries = primaries_of_code(code[0]);
  const auto curve = curve_of_code(code[1]);
  constexpr int kRgb = 0, kFullRange = 1;
  const std::string name = "cICP " + std::to_string(code[0]) + "/" + std::to_string(code[1]);
  if (!primaries || !curve || code[2] != kRgb || code[3] != kFullRange) {
    const char* known = code[1] == 16 ? " (PQ)" : code[1] == 18 ? " (HLG)" : "";
    refuse(path,
           "says cICP with primaries " + std::to_string(code[0]) + ", transfer " +
               std::to_string(code[1]) + known + ", matrix " + std::to_string(code[2]) +
               ", range " + std::to_string(code[3]) + ", which is not converted",
           kCure);
  }
  ColorEncoding result{.name = name};
  result.curves.fill(*curve);
  convert_primaries(result, *primaries, primaries->white, "primaries " + std::to_string(code[0]));
  return result;
}

std::optional<Primaries> chromaticities_of(const PngChunks& png) {
  if (!png.chromaticities) return std::nullopt;
  const auto& c = *png.chromaticities;
  return Primaries{{c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]}, {c[0], c[1]}};
}

ColorEncoding from_gamma(const PngChunks& png) {
  ColorEncoding result = srgb();
  const auto primaries = chromaticities_of(png);
  constexpr double kSrgbGamma = 0.45455;  // written beside sRGB's primaries it means sRGB's curve
  const bool means_srgb = primaries && nearly_equal(*primaries, kRec709) &&
                          std::abs(png.gamma.value_or(0) - kSrgbGamma) < 1e-4;
  if (png.gamma && !means_srgb) {
    if (!(*png.gamma > 0)) {
      result.warnings.emplace_back("its gAMA is 0, which means nothing; sRGB is assumed");
    } else {
      const double exponent = *png.gamma == 1 ? 1 : 1 / *png.gamma;
      result.curves.fill(power_curve(exponent));
      result.name = "gAMA " + short_number(*png.gamma);
    }
  }
  if (primaries) convert_primaries(result, *primaries, primaries->white, "cHRM");
  return result;
}

// ---- Exif and TIFF

std::optional<ColorEncoding> from_exif(const Contents& contents) {
  constexpr std::uint64_t kSrgb = 1, kAdobe = 2, kUncalibrated = 0xffff;
  if (!contents.exif) return std::nullopt;
  const auto space = contents.exif->integer(tiff_tag::kColorSpace);
  if (space == kSrgb) return srgb();
  const bool is_adobe = contents.interoperability == "R03" || space == kAdobe;
  const std::vector<double> gamma = contents.exif->numbers(tiff_tag::kGamma);
  if (is_adobe) {
    constexpr double kExponent = 563.0 / 256.0;  // Adobe RGB (1998) Color Image Encoding, 4.3.1.2
    ColorEncoding result{.name = "Adobe RGB (Exif)"};
    result.curves.fill(power_curve(kExponent));
    result.to_rec709 = to_rec709(kAdobeRgb, kAdobeRgb.white);
    return result;
  }
  if (!gamma.empty() && std::isfinite(gamma[0]) && gamma[0] > 0 && space == kUncalibrated) {
    ColorEncoding result{.name = "gamma " + short_number(gamma[0]) + " (Exif)"};
    result.curves.fill(power_curve(gamma[0]));
    return result;
  }
  if (space == kUncalibrated) {
    ColorEncoding result = srgb();
    result.warnings.emplace_back(
        "its Exif data says 'uncalibrated' and it has no colour profile; "
        "sRGB is assumed");
    return result;
  }
  return std::nullopt;
}

/// TransferFunction, PrimaryChromaticities and WhitePoint. Source: TIFF 6.0, section 20.
void apply_colorimetry(const TiffDirectory& page, bool is_float, bool grey,
                       ColorEncoding& encoding) {
  const std::vector<double> table = page.numbers(tiff_tag::kTransferFunction);
  const auto bits = page.integer(tiff_tag::kBits).value_or(1);
  const std::size_t length = bits <= 16 ? std::size_t{1} << bits : 0;
  if (!table.empty() && !is_float && (table.size() == length || table.size() == 3 * length)) {
    constexpr double kTop = 65535;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t first = table.size() == length ? 0 : c * length;
      std::vector<double> values(table.begin() + static_cast<std::ptrdiff_t>(first),
                                 table.begin() + static_cast<std::ptrdiff_t>(first + length));
      for (double& value : values) value /= kTop;
      encoding.curves[c] = table_curve(std::move(values));
    }
    encoding.name = "TransferFunction";
  } else if (!table.empty()) {
    encoding.warnings.emplace_back(
        "its TransferFunction does not fit its numbers and is ignored; " + encoding.name +
        " is assumed");
  }
  const std::vector<double> white = page.numbers(tiff_tag::kWhitePoint);
  const std::vector<double> rgb = page.numbers(tiff_tag::kPrimaries);
  if (rgb.size() != 6 || grey) return;
  const Chromaticity neutral =
      white.size() == 2 ? Chromaticity{white[0], white[1]} : Chromaticity{kD65};
  convert_primaries(encoding, {{rgb[0], rgb[1]}, {rgb[2], rgb[3]}, {rgb[4], rgb[5]}, neutral},
                    neutral, "PrimaryChromaticities");
}

// ---- floats

ColorEncoding from_exr(const ExrPart& part) {
  ColorEncoding result = linear();
  if (!part.chromaticities && !part.adopted_neutral) return result;
  Primaries primaries = kRec709;
  if (part.chromaticities) {
    const auto& c = *part.chromaticities;
    primaries = {{c[0], c[1]}, {c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]}};
  }
  Chromaticity neutral = primaries.white;
  if (part.adopted_neutral) neutral = {(*part.adopted_neutral)[0], (*part.adopted_neutral)[1]};
  result.name = "linear";
  convert_primaries(result, primaries, neutral,
                    part.adopted_neutral ? "adoptedNeutral" : "chromaticities");
  if (!result.has_matrix()) result.name = linear().name;
  return result;
}

ColorEncoding from_radiance(const std::string& path, const RadianceHeader& header) {
  ColorEncoding result = linear();
  if (header.gamma != 1)
    refuse(path, "says GAMMA=" + short_number(header.gamma) + ", which Radiance does not know",
           kCure);
  if (header.format == "32-bit_rle_xyze") {
    result.name = "XYZ";
    result.to_rec709 = rec709_of_xyz();
  } else if (header.primaries) {
    const auto& c = *header.primaries;
    const Primaries primaries{{c[0], c[1]}, {c[2], c[3]}, {c[4], c[5]}, {c[6], c[7]}};
    convert_primaries(result, primaries, primaries.white, "PRIMARIES");
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const double exposure = header.exposure[c];
    if (!(exposure > 0) || !std::isfinite(exposure))
      refuse(path, "says EXPOSURE or COLORCORR " + short_number(exposure),
             "it must be above 0: export it again");
    if (exposure != 1)
      for (Vector3& row : result.to_rec709) row[c] /= exposure;
  }
  return result;
}

ColorEncoding encoding_of(const std::string& path, const Contents& contents, bool is_float,
                          bool grey) {
  switch (contents.format) {
    case FileFormat::kExr:
      return from_exr(contents.exr);
    case FileFormat::kHdr:
      return from_radiance(path, contents.radiance);
    case FileFormat::kPng:
      if (contents.png.code_points) return from_code_points(path, *contents.png.code_points);
      if (!contents.icc_profile.empty()) return from_profile(path, contents, grey);
      if (contents.png.srgb) return srgb();
      if (contents.png.gamma || contents.png.chromaticities) return from_gamma(contents.png);
      return from_exif(contents).value_or(srgb());
    case FileFormat::kJpeg:
    case FileFormat::kTiff:
      break;
  }
  if (!contents.icc_profile.empty()) return from_profile(path, contents, grey);
  ColorEncoding result = is_float ? linear() : srgb();
  if (!is_float)
    if (auto exif = from_exif(contents)) result = *std::move(exif);
  if (contents.format == FileFormat::kTiff)
    apply_colorimetry(contents.page, is_float, grey, result);
  return result;
}

}  // namespace

ColorEncoding color_encoding(const std::string& path, const Contents& contents, bool is_float,
                             bool grey) {
  try {
    ColorEncoding result = encoding_of(path, contents, is_float, grey);
    if (grey && contents.format != FileFormat::kHdr) result.to_rec709 = kIdentity3;
    return result;
  } catch (const InvalidArgument& error) {
    refuse(path, std::string("has colours that cannot be converted: ") + error.what(), kCure);
  }
}

}  // namespace selenite
