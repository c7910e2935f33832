// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "math/dual.h"
#include "math/vec.h"

// Micronormals, in the frame whose z axis is the shading normal. First isotropic GGX ones. `width2` is the
// squared GGX width, roughness^4. Source: Walter et al. 2007; Heitz 2014 (shadowing); everything is
// written in x^2 + y^2 of the micronormal instead of 1 - cos^2, which keeps its digits for narrow
// lobes (measured: 4e-7 instead of 0.1 relative at width 0.001 in float).
namespace selenite {

/// At or below this squared width a lobe is a mirror, in Cycles as here; the second value is that of
/// Blender 3.x.
inline constexpr double kSingularWidth2 = 2e-10, kSingularWidth2V1 = 1e-7;

/// Density of micronormals, 1/sr. r2 = x^2 + y^2 and z2 = z^2 of the unit micronormal.
template <class T, class U>
auto ggx_normals(const U& r2, const U& z2, const T& width2) {
  return width2 / (square(width2 * z2 + r2) * kPi<scalar_t<T>>);
}

/// Smith's Lambda of a direction with squared tangent tan2 to the shading normal.
template <class T, class U>
auto ggx_lambda(const U& tan2, const T& width2) {
  using std::sqrt;
  using R = decltype(width2 * tan2);
  const R t = width2 * tan2;
  return R(t / ((sqrt(t + R(1)) + R(1)) * scalar_t<R>(2)));
}

/// Squared tangent of the angle of a unit vector to the z axis; the cosine is kept off zero, where
/// a direction lies in the surface.
template <class S>
S tangent2(const Vec3<S>& v) {
  return (v.x * v.x + v.y * v.y) / max(v.z * v.z, S(1e-14));
}

/// A micronormal as seen from wi (wi.z > 0), drawn from D max(m.wi, 0) G1(wi) / wi.z. `turn` is a
/// unit vector in the plane, of uniform direction; u is uniform in [0, 1).
/// Source: Dupuy and Benyoub 2023: seen normals of a hemisphere, reflected, fill a spherical cap.
template <class S>
Vec3<S> ggx_sample_visible(const Vec3<S>& wi, S width, const Vec2<S>& turn, S u) {
  const Vec3<S> stretched = normalize(Vec3<S>{wi.x * width, wi.y * width, wi.z});
  const S z = (1 - u) * (1 + stretched.z) - stretched.z;
  const S r = safe_sqrt((1 - z) * (1 + z));
  const Vec3<S> h = Vec3<S>{r * turn.x, r * turn.y, z} + stretched;
  // Off zero: h vanishes where u tends to 1.
  return normalize(Vec3<S>{h.x * width, h.y * width, max(h.z, S(1e-12))});
}
/// The same of micronormals of two widths.
template <class S>
Vec3<S> ggx_sample_stretched(const Vec3<S>& wi, S x_width, S y_width, S u1, S u2) {
  using std::cos, std::sin;
  const Vec3<S> stretched = normalize(Vec3<S>{wi.x * x_width, wi.y * y_width, wi.z});
  const S z = (1 - u2) * (1 + stretched.z) - stretched.z, phi = 2 * kPi<S> * u1;
  const S r = safe_sqrt((1 - z) * (1 + z));
  const Vec3<S> h = Vec3<S>{r * cos(phi), r * sin(phi), z} + stretched;
  return normalize(Vec3<S>{h.x * x_width, h.y * y_width, max(h.z, S(1e-12))});
}
template <class S>
Vec3<S> ggx_sample_visible(const Vec3<S>& wi, S width, S u1, S u2) {
  using std::cos, std::sin;
  const S phi = 2 * kPi<S> * u1;
  return ggx_sample_visible(wi, width, Vec2<S>{cos(phi), sin(phi)}, u2);
}

// The others. Those of different widths along x and y are isotropic ones in stretched coordinates. They
// have the squared mean width `width2`, x width times y width. Their `stretch` is y width over x
// width.

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

/// What both of them change by when the x axis turns by a small angle towards the y axis; `twice_xy`: of
/// the micronormal, or of the direction over the square of its z component. `ratio`: the stretch of a
/// micronormal, its inverse of a direction.
template <class S, class T>
T twisted(const S& twice_xy, const T& ratio, const T& angle) {
  return (ratio - T(S(1)) / ratio) * (angle * twice_xy);
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
/// m2: squares of the unit micronormal; r2: its squared distance to the z axis, stretched; cos_m: its
/// cosine to the viewer. Source: Ashikhmin and Shirley 2000, equation 4.
template <class T, class S>
T ashikhmin_shirley(const Vec3<S>& m2, const T& r2, const S& cos_m, const S& cos_i, const S& cos_o,
                    const T& width2, const T& stretch) {
  using std::exp, std::log1p, std::sqrt;
  const S across = m2.x + m2.y;
  // The exponent is nx hx^2 + ny hy^2 over hx^2 + hy^2, nx = 2 / x width^2 - 2.
  const T mean = across > S(0) ? r2 / (width2 * across) - T(S(1)) : T(S(0));
  const S log_z2 = -log1p(S(across / max(m2.z, S(1e-14))));
  const T twice = T(S(2)) / width2;
  const T scale = sqrt((twice * stretch - T(S(1))) * (twice / stretch - T(S(1))));
  return scale * exp(mean * log_z2) * (cos_o / (8 * kPi<S> * cos_m * max(cos_i, cos_o)));
}

}  // namespace selenite
