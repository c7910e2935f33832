// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "image/format.h"

namespace selenite {

/// Pixels; checked on the header, before memory is asked for.
inline constexpr std::int64_t kLargestPicture = 100'000'000;

/// What the header of a picture says.
struct PictureInfo {
  FileFormat format;
  int width = 0, height = 0;
  int channels = 0;   ///< in the file, alpha included
  int bit_depth = 0;  ///< of one channel: 8 or 16 (integers or half), 32 (float)
  bool is_float = false;
  int orientation = 1;  ///< EXIF: 1 = upright; reported, never applied
  bool grey = false;
  bool cmyk = false;                  ///< converted to RGB without its colour profile
  std::vector<std::string> warnings;  ///< one sentence each: kept, but worth knowing
};

struct Photo {
  PictureInfo info;
  std::vector<float> pixels;  ///< (height, width, 3), row 0 at the top; grey is repeated
  std::vector<float> alpha;   ///< (height, width) in [0, 1], or empty; never multiplied into pixels
  std::vector<std::uint8_t> valid;    ///< (height, width); 0 where a channel was NaN or infinite
  std::vector<std::uint8_t> clipped;  ///< (height, width); 1 where an integer channel is at its top
  std::int64_t nan_pixels = 0;        ///< set to 0 and not valid
  std::int64_t negative_pixels = 0;   ///< channels below 0 set to 0
};

/// Reads the header and refuses what `read_photo` would refuse by it. Throws FileError.
PictureInfo probe_photo(const std::string& path);

/// Reads PNG, JPEG, TIFF (8 and 16 bit integers, floats), OpenEXR or Radiance HDR.
///
/// Integer files are decoded with the sRGB curve unless `as_linear` is false (then: value / top
/// value); float files are taken as they are, with colour divided by alpha where that is above 0.
/// Throws FileError: missing, not a picture, over 100 megapixels, truncated or damaged, palette or
/// fewer than 8 bits, deep, several layers, or a cropped data window.
Photo read_photo(const std::string& path, bool as_linear = true);

}  // namespace selenite
