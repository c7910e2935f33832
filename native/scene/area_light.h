// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <limits>

#include "math/lanes.h"
#include "math/sampling.h"
#include "scene/light.h"

// Area lamps, which most scenes are lit by, for one path or for eight: S is float or Lanes.
namespace selenite {

/// LightSample and LightHit of those that exist.
template <class S>
struct AreaSample {
  mask_t<S> exists;
  Vec3<S> direction;
  S distance, density, factor;
};
template <class S>
struct AreaHit {
  mask_t<S> exists;
  S density, factor, distance;
};

/// Share of the radiance that the lamp's spread lets out at a cosine to its axis.
template <class S>
S area_factor(const Light& light, const S& cos_light) {
  if (light.tan_spread == std::numeric_limits<float>::infinity()) return S(1);
  const S tangent = safe_sqrt(S(1) - square(cos_light)) / cos_light;
  return max(S(0), S(1) - tangent / S(light.tan_spread)) * light.spread_norm;
}

template <class S>
AreaSample<S> sample_area(const Light& light, const Vec3<S>& point, const S& u1, const S& u2) {
  using std::sqrt;
  const Vec2<S> s =
      light.ellipse ? square_to_disc(u1, u2) : Vec2<S>{S(2) * u1 - S(1), S(2) * u2 - S(1)};
  const Vec3<S> d =
      Vec3<S>(light.position) - point + Vec3<S>(light.u) * s.x + Vec3<S>(light.v) * s.y;
  const S distance2 = dot(d, d), distance = sqrt(distance2);
  const Vec3<S> direction = d / distance;
  const S cos_light = -dot(direction, Vec3<S>(light.axis));
  const S factor = area_factor(light, cos_light) * light.scale;
  const mask_t<S> exists = (distance2 > 0) & (cos_light > 0) & (factor > 0);
  return {exists, direction, distance, distance2 / (cos_light * light.area), factor};
}

template <class S>
AreaHit<S> intersect_area(const Light& light, const Vec3<S>& origin, const Vec3<S>& direction,
                          const S& t_min, const S& t_max) {
  using std::abs;
  const Vec3<S> to_center = Vec3<S>(light.position) - origin, axis(light.axis);
  const S cos_light = -dot(direction, axis);
  const S t = -dot(to_center, axis) / cos_light;
  const Vec3<S> d = direction * t - to_center;
  // Coordinates in the half edges, which a sheared object leaves oblique: solve the 2x2 system.
  const float uu = dot(light.u, light.u), uv = dot(light.u, light.v), vv = dot(light.v, light.v);
  const float determinant = uu * vv - uv * uv;
  const S du = dot(d, Vec3<S>(light.u)), dv = dot(d, Vec3<S>(light.v));
  const S a = (du * vv - dv * uv) / S(determinant), b = (dv * uu - du * uv) / S(determinant);
  const mask_t<S> within = light.ellipse ? a * a + b * b <= 1 : max(abs(a), abs(b)) <= 1;
  const mask_t<S> exists = (cos_light > 0) & (t > t_min) & (t < t_max) & within;
  return {exists, t * t / (cos_light * light.area), area_factor(light, cos_light) * light.scale, t};
}

}  // namespace selenite
