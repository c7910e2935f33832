// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/driver/tile.h"

namespace selenite {
template TileReport render_tile<16>(const Prepared<16>&, const PixelCamera&, const RenderSettings&,
                                    const Tile&, Film&);
}
