// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>

namespace selenite {

/// Pixels along a side of a tile.
inline constexpr int kTileSize = 16;

/// Pixels from (x0, y0) up to but without (x1, y1).
struct Tile {
  int x0, y0, x1, y1;
};

/// Counts of the work on a tile, and of what went wrong.
struct TileReport {
  std::int64_t dropped = 0;
  std::int64_t truncated = 0;
  std::int64_t vertices = 0, exits = 0;  ///< see Film
  std::string first_dropped;

  /// A sample had something that is not finite: its radiance (slot -1) or a derivative. It counts as
  /// zero: the pixel stays finite and the report says so.
  void drop(int x, int y, int sample, int slot);
};

}  // namespace selenite
