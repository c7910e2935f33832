// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "render/driver/progress.h"
#include "render/film/film.h"
#include "render/film/render_settings.h"
#include "render/film/tile.h"

namespace selenite {

/// Calls `work` for every tile of the picture, from as many threads as asked for, and counts
/// progress. Throws what `work` throws, and Cancelled.
void for_each_tile(const RenderSettings& settings, Progress* progress,
                   const std::function<void(int index, const Tile& tile)>& work);
int tile_count(const RenderSettings& settings);
/// Adds the counts of a tile to a film's, in tile order so that the first one named is the same
/// whatever the threads did.
void add_reports(const std::vector<TileReport>& reports, Film& film);

}  // namespace selenite
