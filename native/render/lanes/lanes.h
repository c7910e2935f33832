// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "render/film/tile.h"
#include "render/prepared/prepared.h"

namespace selenite {

/// Whether this build has the kernel that traces paths eight at a time in lockstep, and this processor
/// AVX2 and FMA, for which it is compiled.
bool has_lanes();

/// What keeps a scene from being traced by that kernel, in words; empty if nothing does. It is for
/// materials that are the same everywhere, without emission, transparency, sheen and subsurface
/// scattering, and for at most one medium, homogeneous and inside of a closed body from where no light
/// is seen. Anything else is traced path by path.
template <int L>
std::string lanes_obstacle(const Prepared<L>& prepared);
/// The same of processor and scene.
std::string lanes_obstacle(const Scene& scene);

/// As `render_tile`, where there are lanes and no obstacle.
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
