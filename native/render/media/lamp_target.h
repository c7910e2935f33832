// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "scene/light.h"

namespace selenite {

/// What light is sought at from inside a body: a point of a lamp, or a direction if the lamp is
/// infinitely far.
struct LampTarget {
  Vec3f place;
  bool infinite = false;

  Vec3f direction_from(const Vec3f& point) const {
    return infinite ? place : normalize(place - point);
  }
};

/// As `Light::sample` draws it from a point; empty if no light comes from there.
std::optional<LampTarget> draw_target(const Light& lamp, const Vec3f& from, float u1, float u2);

struct FoundTarget {
  LampTarget target;
  float density;  ///< of the direction at the surface, per solid angle; 1 for a lamp without size
};
/// The target that leads to a direction at a surface, if it is drawn from `from`; empty if none does.
std::optional<FoundTarget> find_target(const Light& lamp, const Vec3f& from, const Vec3f& surface,
                                       const Vec3f& direction);

/// The lamp, of whatever size, in a direction that leads to a target; empty if it is black there. The
/// density is 0 without size.
std::optional<LightHit> lamp_along(const Light& lamp, const Vec3f& from, const Vec3f& direction);

}  // namespace selenite
