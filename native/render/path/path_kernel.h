// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "render/film/tile.h"
#include "render/prepared/prepared.h"

namespace selenite {

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
