// SPDX-License-Identifier: GPL-3.0-or-later
#include "render/shape/scattering.h"

namespace selenite {
namespace {

/// Radians, and shares of a triangle: rounding is below 1e-3 of the slope, and so is the curvature of
/// a highlight of roughness 0.2.
constexpr float kStep = 3e-3f;

/// The gradient on the sphere, channel by channel, of `value(direction)`.
template <class Value>
std::array<Vec3f, 3> on_sphere(const Vec3f& direction, const Value& value) {
  const auto frame = Frame<float>::from_normal(direction);
  std::array<Vec3f, 3> slopes{};
  for (const Vec3f& axis : {frame.s, frame.t}) {
    const Colorf change =
        (value(normalize(direction + axis * kStep)) - value(normalize(direction - axis * kStep))) /
        (2 * kStep);
    for (int c = 0; c < 3; ++c) slopes[c] += axis * change[c];
  }
  return slopes;
}

}  // namespace

ScatteringSlopes Scattering::slopes(const Vec3f& wo) const {
  ScatteringSlopes found;
  with_bsdf([&](const auto& bsdf) {
    found.value = bsdf.value(wo);
    found.by_wo = on_sphere(wo, [&](const Vec3f& to) { return bsdf.value(to); });
  });
  const auto value_at = [&](const Hit& at, const Surface& s, const Vec3f& viewer) {
    return with_bsdf(at, s, viewer, [&](const auto& bsdf) { return bsdf.value(wo); });
  };
  found.by_wi = on_sphere(wi, [&](const Vec3f& viewer) { return value_at(hit, surface, viewer); });
  if (varies()) {
    const auto change = [&](float Hit::*share) {
      Colorf sides[2];
      for (int i = 0; i < 2; ++i) {
        Hit at = hit;
        at.*share += i == 0 ? -kStep : kStep;
        Surface s = surface;
        s.position = p_.geometry.surface(at).position;
        sides[i] = value_at(at, s, wi);
      }
      return (sides[1] - sides[0]) / (2 * kStep);
    };
    found.by_b1 = change(&Hit::b1);
    found.by_b2 = change(&Hit::b2);
  }
  return found;
}

}  // namespace selenite
