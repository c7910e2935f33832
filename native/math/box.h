// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <limits>

#include "math/vec.h"

namespace selenite {

/// Axis-aligned box; empty until something is put into it.
struct Box {
  Vec3f low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};

  void include(const Vec3f& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  bool contains(const Vec3f& p) const {
    return p.x >= low.x && p.x <= high.x && p.y >= low.y && p.y <= high.y && p.z >= low.z &&
           p.z <= high.z;
  }
  bool overlaps(const Box& other) const {
    return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y &&
           other.low.y <= high.y && low.z <= other.high.z && other.low.z <= high.z;
  }

 private:
  static constexpr float kFar = std::numeric_limits<float>::infinity();
};

}  // namespace selenite
