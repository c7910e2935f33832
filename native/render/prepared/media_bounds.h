// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <vector>

#include "scene/geometry.h"

namespace selenite {

/// The boxes around the bodies that hold a medium.
class MediaBounds {
 public:
  void include(const Geometry& geometry, int instance) {
    boxes_.push_back(geometry.bounds(instance));
    if (!geometry.closed(instance)) boundless_ = true;
  }
  /// False where there is no medium for sure.
  bool contains(const Vec3f& point) const {
    return boundless_ || std::any_of(boxes_.begin(), boxes_.end(),
                                     [&](const Box& box) { return box.contains(point); });
  }

 private:
  std::vector<Box> boxes_;
  bool boundless_ = false;  // a mesh that is open has no box to be outside of
};

}  // namespace selenite
