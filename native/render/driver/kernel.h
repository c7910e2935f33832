// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "render/prepared/prepared.h"
#include "render/driver/render.h"

namespace selenite {

/// Local slots that a kernel is compiled for: no derivatives, or up to 4, 8 or 16 ticked parameters
/// of one material.
inline constexpr int kMaxLocalSlots = 16;

/// Pixels along a side of a tile.
inline constexpr int kTileSize = 16;

/// Counts of what went wrong in a tile.
struct TileReport {
  std::int64_t dropped = 0;
  std::int64_t truncated = 0;
  std::string first_dropped;

  /// A sample had something that is not finite: its radiance (slot -1) or a derivative. It counts as
  /// zero: the pixel stays finite and the report says so.
  void drop(int x, int y, int sample, int slot);
};

/// Pixels from (x0, y0) up to but without (x1, y1).
struct Tile {
  int x0, y0, x1, y1;
};

/// Calls `work` for every tile of the picture, from as many threads as asked for, and counts
/// progress. Throws what `work` throws, and Cancelled.
void for_each_tile(const RenderSettings& settings, Progress* progress,
                   const std::function<void(int index, const Tile& tile)>& work);
int tile_count(const RenderSettings& settings);
/// Adds the counts of a tile to a film's, in tile order so that the first one named is the same
/// whatever the threads did.
void add_reports(const std::vector<TileReport>& reports, Film& film);

/// Renders all samples of the pixels of a tile and writes their statistics into the film.
template <int L>
TileReport render_tile(const Prepared<L>& prepared, const PixelCamera& camera,
                       const RenderSettings& settings, const Tile& tile, Film& film);

extern template TileReport render_tile<0>(const Prepared<0>&, const PixelCamera&,
                                          const RenderSettings&, const Tile&, Film&);
extern template TileReport render_tile<4>(const Prepared<4>&, const PixelCamera&,
                                          const RenderSettings&, const Tile&, Film&);
extern template TileReport render_tile<8>(const Prepared<8>&, const PixelCamera&,
                                          const RenderSettings&, const Tile&, Film&);
extern template TileReport render_tile<16>(const Prepared<16>&, const PixelCamera&,
                                           const RenderSettings&, const Tile&, Film&);

}  // namespace selenite
