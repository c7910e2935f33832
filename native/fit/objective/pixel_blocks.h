// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstddef>

namespace selenite {

/// Square blocks of a picture, `along` of them on its longer side: pixels of one share what no value
/// explains, pixels of two do not. The block of each pixel, and how many there are.
struct PixelBlocks {
  int side, columns, count;
  PixelBlocks(int width, int height, int along)
      : side(std::max((std::max(width, height) + along - 1) / along, 1)),
        columns((width + side - 1) / side),
        count(columns * ((height + side - 1) / side)) {}
  std::size_t of(int x, int y) const {
    return static_cast<std::size_t>(y / side) * static_cast<std::size_t>(columns) +
           static_cast<std::size_t>(x / side);
  }
};

}  // namespace selenite
