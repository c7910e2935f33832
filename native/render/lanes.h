// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/kernel.h"

namespace selenite {

/// Whether this build has the kernel that traces eight paths in lockstep, and this processor AVX2 and
/// FMA, for which it is compiled.
bool has_lanes();

/// Whether the scene is one for that kernel: materials that are the same everywhere, without emission,
/// transparency, sheen and subsurface scattering, and at most one medium, homogeneous and inside of a
/// closed body from where no light is seen. Anything else is traced path by path.
template <int L>
bool suits_lanes(const Prepared<L>& prepared);

/// As `render_tile`, for a scene that suits lanes, where there are lanes.
template <int L>
TileReport render_tile_by_lanes(const Prepared<L>& prepared, const PixelCamera& camera,
                                const RenderSettings& settings, const Tile& tile, Film& film);

template <>
TileReport render_tile_by_lanes(const Prepared<0>&, const PixelCamera&, const RenderSettings&,
                                const Tile&, Film&);
template <>
TileReport render_tile_by_lanes(const Prepared<2>&, const PixelCamera&, const RenderSettings&,
                                const Tile&, Film&);
template <>
TileReport render_tile_by_lanes(const Prepared<4>&, const PixelCamera&, const RenderSettings&,
                                const Tile&, Film&);
template <>
TileReport render_tile_by_lanes(const Prepared<8>&, const PixelCamera&, const RenderSettings&,
                                const Tile&, Film&);

}  // namespace selenite
