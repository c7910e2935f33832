// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "image/header/file_view.h"

namespace selenite {

/// A rectangle of pixels; both corners belong to it.
struct ExrWindow {
  std::int64_t x0 = 0, y0 = 0, x1 = -1, y1 = -1;
  std::int64_t width() const { return x1 - x0 + 1; }
  std::int64_t height() const { return y1 - y0 + 1; }
  bool operator==(const ExrWindow&) const = default;
};

struct ExrChannel {
  std::string name;
  int type = 0;  ///< 0: unsigned int, 1: half, 2: float
  int x_sampling = 1, y_sampling = 1;
};

/// One part of an OpenEXR file.
struct ExrPart {
  std::string name;
  std::string type;  ///< "scanlineimage", "tiledimage", "deepscanline", "deeptile"
  std::vector<ExrChannel> channels;
  ExrWindow data, display;
  std::optional<std::array<double, 8>> chromaticities;  ///< red, green, blue, white (x, y)
  std::optional<std::array<double, 2>> adopted_neutral;
  double pixel_aspect = 1;
  std::int64_t tile_width = 0, tile_height = 0;

  bool has(const std::string& channel) const;
};

/// The parts that the header names; empty if it cannot be understood. Source: OpenEXR file layout.
std::vector<ExrPart> exr_parts(const FileView& view);

}  // namespace selenite
