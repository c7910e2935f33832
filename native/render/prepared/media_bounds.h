// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <vector>

#include "scene/geometry.h"
#include "scene/light.h"

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
  /// How large a lamp is, seen from the middle of the body next to it as if it faced that: steradians.
  float solid_angle(const Light& lamp) const {
    if (lamp.kind == LightKind::kSun) return 2 * kPi<float> * lamp.one_minus_cos_sun;
    float largest = 0;
    for (const Box& box : boxes_) {
      const Vec3f apart = lamp.position - (box.low + box.high) / 2.0f;
      if (lamp.area > 0) largest = std::max(largest, lamp.area / dot(apart, apart));
    }
    return largest;
  }

 private:
  std::vector<Box> boxes_;
  bool boundless_ = false;  // a mesh that is open has no box to be outside of
};

}  // namespace selenite
