// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/camera.h"

namespace selenite {

/// Where a camera stood relative to the scene's: pixels of the picture to the right and down, and
/// radians about its axis.
struct Alignment {
  double x = 0, y = 0, roll = 0;
  bool operator==(const Alignment&) const = default;
  /// The same shift where a pixel is `factor` times as large.
  Alignment scaled(double factor) const { return {x * factor, y * factor, roll}; }
  /// The camera with it, for a picture of that size.
  Camera apply(Camera camera, int width, int height, const PhotoFrame& frame) const;
};

}  // namespace selenite
