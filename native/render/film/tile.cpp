// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/film/tile.h"

namespace selenite {

void TileReport::drop(int x, int y, int sample, int slot) {
  if (dropped++ > 0) return;
  first_dropped = "pixel (" + std::to_string(x) + ", " + std::to_string(y) + "), sample " +
                  std::to_string(sample) + ", " +
                  (slot < 0 ? "radiance" : "derivative " + std::to_string(slot));
}

}  // namespace selenite
