// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/vec.h"

namespace selenite {

/// Unit square to unit disc, area-preserving and continuous. Source: Shirley and Chiu 1997.
template <class S>
Vec2<S> square_to_disc(S u, S v) {
  using std::abs, std::cos, std::sin;
  const S a = 2 * u - 1, b = 2 * v - 1;
  const mask_t<S> centre = (a == S(0)) & (b == S(0));
  if (all(centre)) return {};
  const mask_t<S> wide = abs(a) > abs(b);
  const S radius = select(wide, a, b);
  const S eighth = kPi<S> / 4 * (select(wide, b, a) / select(centre, S(1), radius));
  const S angle = select(wide, eighth, S(kPi<S> / 2 - eighth));
  return {radius * cos(angle), radius * sin(angle)};
}

/// Direction in the upper hemisphere with density cos/pi.
template <class S>
Vec3<S> square_to_cosine_hemisphere(S u, S v) {
  const Vec2<S> d = square_to_disc(u, v);
  return {d.x, d.y, safe_sqrt(S(1) - d.x * d.x - d.y * d.y)};
}

/// Direction uniform in the cone around +z with cosine in [cos_max, 1]; density 1/(2 pi (1 - cos_max)).
/// Takes 1 - cos_max, which a narrow cone keeps its digits in.
template <class S>
Vec3<S> square_to_cone(S u, S v, S one_minus_cos_max) {
  const Vec2<S> d = square_to_disc(u, v);
  const S r2 = d.x * d.x + d.y * d.y;
  const S one_minus_cos = r2 * one_minus_cos_max;
  const S scale = safe_sqrt(one_minus_cos_max * (S(2) - one_minus_cos));
  return {d.x * scale, d.y * scale, S(1) - one_minus_cos};
}

/// A unit vector turned by an angle of the given cosine, to the side that u in [0, 1) says.
template <class S>
Vec3<S> deflect(const Vec3<S>& direction, S cosine, S u) {
  using std::cos, std::sin;
  const S sine = safe_sqrt((1 - cosine) * (1 + cosine)), phi = 2 * kPi<S> * u;
  return normalize(
      Frame<S>::from_normal(direction).to_world({sine * cos(phi), sine * sin(phi), cosine}));
}

/// Exponentially distributed with mean 1. u of `Random` has 24 bits: 1 - u is exact.
template <class S>
S exponential(S u) {
  using std::log;
  return -log(1 - u);
}

/// Weight of the strategy with density `a` against the one with density `b`.
/// Source: Veach 1997, power heuristic with exponent 2 (what Cycles uses).
template <class S>
S power_heuristic(S a, S b) {
  const mask_t<S> possible = a > S(0);
  if (!any(possible)) return S(0);
  const S ratio = b / a;  // keeps a^2 from overflowing
  return select(possible, S(S(1) / (S(1) + ratio * ratio)), S(0));
}

}  // namespace selenite
