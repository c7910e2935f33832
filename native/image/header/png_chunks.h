// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "image/header/file_view.h"

namespace selenite {

/// What the chunks of a PNG before its pixels say. Source: PNG specification, third edition.
struct PngChunks {
  std::int64_t width = 0, height = 0;
  int bit_depth = 0, channels = 0;  ///< as stored; transparency of a colour adds one
  bool palette = false;
  std::optional<FileView> profile;                      ///< iCCP, name in front, compressed
  bool srgb = false;                                    ///< sRGB
  bool animated = false;                                ///< acTL
  std::optional<double> gamma;                          ///< gAMA: exponent of the encoding
  std::optional<std::array<double, 8>> chromaticities;  ///< cHRM: white, red, green, blue (x, y)
  /// cICP: colour primaries, transfer, matrix, full range; code points of ITU-T H.273
  std::optional<std::array<int, 4>> code_points;
  std::optional<FileView> exif;  ///< eXIf
};

PngChunks png_chunks(const FileView& view);

}  // namespace selenite
