// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/tile.h"

namespace selenite {
template TileReport render_tile<4>(const Prepared<4>&, const PixelCamera&, const RenderSettings&,
                                   const Tile&, Film&);
}
