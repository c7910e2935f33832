// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "image/format.h"

namespace selenite {

struct ColorEncoding;
struct Contents;
struct StoredForm;

/// What the header of a picture says.
struct PictureInfo {
  FileFormat format = FileFormat::kPng;
  int width = 0, height = 0;  ///< of the frame (OpenEXR: of the display window)
  int channels = 0;           ///< in the file, alpha included
  int bit_depth = 0;          ///< of one channel: 8 or 16 (integers or half), 32 or 64 (floats)
  bool is_float = false;
  int orientation = 1;  ///< Exif: 1 = upright; reported, never applied
  bool grey = false;
  bool cmyk = false;                  ///< converted to RGB without a colour profile
  std::string color;                  ///< what its numbers mean, as "sRGB"
  std::vector<std::string> warnings;  ///< one clause each: kept, but worth knowing
};

/// Whether a pixel counts, and the first reason why not.
enum class PixelUse : std::uint8_t {
  kCounts,
  kNotFinite,     ///< NaN or infinite, in a colour or alpha
  kNegative,      ///< a stored colour is farther below 0 than noise is
  kClipped,       ///< see clipping.h
  kOutsideGamut,  ///< Rec. 709 has no such colour
  kOutsideFile,   ///< of the frame, but not stored
  kTooDark,       ///< below the code values that count, see response.h
};
inline constexpr std::size_t kPixelUses = 7;
/// As in Python's `counts`.
inline constexpr std::array<const char*, kPixelUses> kPixelUseNames{
    "used", "not_finite", "negative", "clipped", "outside_gamut", "outside_file", "too_dark"};

/// Pixels of each use.
class PixelCounts {
 public:
  void add(PixelUse use) { ++counts_[static_cast<std::size_t>(use)]; }
  void add(const PixelCounts& other) {
    for (std::size_t i = 0; i < kPixelUses; ++i) counts_[i] += other.counts_[i];
  }
  std::int64_t operator[](PixelUse use) const { return counts_[static_cast<std::size_t>(use)]; }
  std::int64_t all() const;

 private:
  std::array<std::int64_t, kPixelUses> counts_{};
};

struct Photo {
  PictureInfo info;
  std::vector<float> pixels;  ///< (height, width, 3), row 0 at the top; grey is repeated
  std::vector<float> alpha;   ///< (height, width) in [0, 1], or empty; never multiplied into pixels
  std::vector<PixelUse> use;  ///< (height, width)
  PixelCounts counts;
};

/// Reads the header and refuses what `read_photo` would refuse by it. Throws FileError.
PictureInfo probe_photo(const std::string& path, bool as_linear = true);

/// Reads PNG, JPEG, TIFF (integers of 8 to 16 bits, floats), OpenEXR or Radiance HDR.
///
/// Colours are converted to linear Rec. 709 as the file says (color/encoding.h); what is not finite
/// or below 0 becomes 0, but linear floats keep noise: what reaches 2 % of the bright level below 0. `as_linear` false: stored values, integers divided by their top.
/// Throws FileError: missing, not a picture, beyond the limits, truncated or damaged, or one of
/// those that `examine` refuses.
Photo read_photo(const std::string& path, bool as_linear = true);

/// Joins what header and decoder say, and works out the encoding of the colours. Throws FileError.
PictureInfo picture_info(const std::string& path, const Contents& contents, const StoredForm& form,
                         bool as_linear, ColorEncoding& encoding);

}  // namespace selenite
