// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/tile.h"

namespace selenite {
template TileReport render_tile<0>(const Prepared<0>&, const PixelCamera&, const RenderSettings&,
                                   const Tile&, Film&);
}
