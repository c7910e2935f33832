// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/derivatives/sparse_gradient.h"
#include "render/driver/field_gradient.h"
#include "render/film/tile.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// What the paths of a tile need besides the prepared scene.
struct TapedWork {
  const std::vector<Field>& fields;
  const PixelLoss& loss;  ///< empty: no gradient
  int cell = kTileSize;   ///< pixels along a side of a cell; divides that of a tile
  /// A number of an image that acts on all channels is a place of its own, whose derivatives are channel by
  /// channel. False: three numbers of a texel are those of a place, each the sum over the channels.
  bool number_places = false;
};

/// How many cells lie across a tile.
inline int cells_across(int cell) { return kTileSize / cell; }

/// Renders all samples of a tile's pixels and sweeps their tapes: one gradient a field for each cell,
/// row by row.
template <int L>
TileReport render_taped_tile(const Prepared<L>& prepared, const PixelCamera& camera,
                             const RenderSettings& settings, const Tile& tile,
                             const TapedWork& work, Film& film,
                             std::vector<SparseGradient>& gradients);

extern template TileReport render_taped_tile<kTaped>(const Prepared<kTaped>&, const PixelCamera&,
                                                     const RenderSettings&, const Tile&,
                                                     const TapedWork&, Film&,
                                                     std::vector<SparseGradient>&);
extern template TileReport render_taped_tile<kTapedMaps>(const Prepared<kTapedMaps>&,
                                                         const PixelCamera&, const RenderSettings&,
                                                         const Tile&, const TapedWork&, Film&,
                                                         std::vector<SparseGradient>&);

}  // namespace selenite
