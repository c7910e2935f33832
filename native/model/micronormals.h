// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "model/ggx.h"

// Micronormals other than isotropic GGX ones, in the terms of ggx.h. Those of different widths along x
// and y are described by the squared mean width, `width2` = x width times y width, and by the
// `stretch`, y width over x width: they are isotropic ones in stretched coordinates.
namespace selenite {

enum class Micronormals { kGgx, kBeckmann, kAshikhminShirley };

/// Ashikhmin and Shirley's lobe is a mirror at or below this squared width, in Cycles as here.
inline constexpr double kSingularWidth2Ashikhmin = 1e-8;

/// Squared distance of a micronormal to the z axis as the isotropic functions take it, by the squares
/// of its components.
template <class S, class T>
T stretched_normal(const S& x2, const S& y2, const T& stretch) {
  return stretch * x2 + T(y2) / stretch;
}
/// Squared tangent of a direction, likewise; see tangent2.
template <class S, class T>
T stretched_tangent2(const Vec3<S>& v, const T& stretch) {
  return (T(v.x * v.x) / stretch + stretch * (v.y * v.y)) / max(v.z * v.z, S(1e-14));
}

/// Density of Beckmann's micronormals, 1/sr. Source: Walter et al. 2007, equation 25.
template <class T, class U>
auto beckmann_normals(const U& r2, const U& z2, const T& width2) {
  using std::exp;
  using R = decltype(width2 * r2);
  return R(exp(-(R(r2) / (width2 * z2))) / (width2 * (z2 * z2) * kPi<scalar_t<T>>));
}

/// Lambda of Beckmann's micronormals, by the rational fit that Cycles takes. Source: Walter et al. 2007.
template <class T, class U>
auto beckmann_lambda(const U& tan2, const T& width2) {
  using std::sqrt;
  using R = decltype(width2 * tan2);
  using S = scalar_t<R>;
  const R t = width2 * tan2;
  if (value_of(t) < S(0.39)) return R(S(0));
  const R a = R(S(1)) / sqrt(t);
  return R(((a * S(0.396) - R(S(1.259))) * a + R(S(1))) / ((a * S(2.181) + R(S(3.535))) * a));
}

/// Reflection by Ashikhmin and Shirley's lobe without its Fresnel term, times the light's cosine, 1/sr.
/// r2: squared distance of the unit micronormal (x2, y2, z2) to the z axis, stretched; cos_m: its cosine
/// to the viewer. Source: Ashikhmin and Shirley 2000, equation 4.
template <class T, class S>
T ashikhmin_shirley(const Vec3<S>& m2, const S& cos_m, const S& cos_i, const S& cos_o,
                    const T& width2, const T& stretch) {
  using std::exp, std::log1p, std::sqrt;
  const S across = m2.x + m2.y;
  // The exponent is nx hx^2 + ny hy^2 over hx^2 + hy^2, nx = 2 / x width^2 - 2.
  const T mean =
      across > S(0) ? stretched_normal(m2.x, m2.y, stretch) / (width2 * across) - T(S(1)) : T(S(0));
  const S log_z2 = -log1p(S(across / max(m2.z, S(1e-14))));
  const T twice = T(S(2)) / width2;
  const T scale = sqrt((twice * stretch - T(S(1))) * (twice / stretch - T(S(1))));
  return scale * exp(mean * log_z2) * (cos_o / (8 * kPi<S> * cos_m * max(cos_i, cos_o)));
}

}  // namespace selenite
