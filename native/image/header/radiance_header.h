// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "image/header/file_view.h"

namespace selenite {

/// Header of a Radiance picture. Source: Radiance file formats, section "Picture File Format".
struct RadianceHeader {
  std::string format;  ///< "32-bit_rle_rgbe" or "32-bit_rle_xyze"
  /// Product of all EXPOSURE and COLORCORR lines: stored value / radiance, for each channel
  std::array<double, 3> exposure{1, 1, 1};
  std::optional<std::array<double, 8>> primaries;  ///< red, green, blue, white (x, y)
  double gamma = 1;                                ///< of programs that are not Radiance
  /// Resolution line: a scanline runs along y if `columns_first`; negative steps as in "-Y"
  bool columns_first = false, x_decreases = false, y_decreases = true;
  int scanlines = 0, scanline_length = 0;  ///< 0: there is no resolution line
};

RadianceHeader radiance_header(const FileView& view);

}  // namespace selenite
