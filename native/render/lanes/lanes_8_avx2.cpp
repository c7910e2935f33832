// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/lanes/lane_tile.h"
#include "render/lanes/lanes.h"

namespace selenite {
template <>
TileReport render_tile_by_lanes(const Prepared<8>& prepared, const PixelCamera& camera,
                                const RenderSettings& settings, const Tile& tile, Film& film) {
  return trace_tile(prepared, camera, settings, tile, film);
}
}  // namespace selenite
