// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "math/vec.h"
#include "model/narrow.h"

namespace selenite {

/// The micronormal that a direction was made from, where it is known: more precise than what the
/// directions give back.
template <class S>
struct DrawnNormal {
  Vec3<S> m{};
  mask_t<S> known = false;

  DrawnNormal() = default;
  DrawnNormal(const Vec3<S>& m, const mask_t<S>& known) : m(m), known(known) {}
  /// Null: not known.
  DrawnNormal(const Vec3<S>* m) : known(m != nullptr) {  // NOLINT(google-explicit-constructor)
    if (m) this->m = *m;
  }
};

/// Refraction that Cycles samples as if it were singular.
template <class R>
bool bends_nothing(R eta) {
  using std::abs;
  return abs(eta - 1) < R(1e-4);
}

/// Micronormal geometry of a refraction, over any scalar: the half vector depends on eta.
template <class X>
struct Refraction {
  using S = scalar_t<X>;

  X r2, z2, cos_m, cos_o, length2;  // squares of m; |m.wi|, |m.wo|; |wi + eta wo|^2

  Refraction(const Vec3<S>& wi, const Vec3<S>& wo, const uniform_t<X>& eta,
             const DrawnNormal<S>& drawn) {
    using std::abs, std::sqrt;
    X x = eta * wo.x + X(wi.x), y = eta * wo.y + X(wi.y), z = eta * wo.z + X(wi.z);
    const S cos_io = dot(wi, wo);
    X by_i = eta * cos_io + X(1), by_o = eta + X(cos_io);  // wi + eta wo times wi, wo
    if (any(drawn.known)) {
      // wi + eta wo = m (c - g) cancels near eta = 1, and its rounding would be in the derivatives of
      // all that is divided by its length. Its own derivative does not cancel.
      const number_t<X> e = (value_of(eta) - 1) * (value_of(eta) + 1);
      const S c = dot(drawn.m, wi);
      const S g = safe_sqrt(S(e + c * c)), length = -e / (c + g);
      const auto correct = [&drawn](X& number, const S& value) {
        number = with_value(number, select(drawn.known, value, value_of(number)));
      };
      correct(x, drawn.m.x * length);
      correct(y, drawn.m.y * length);
      correct(z, drawn.m.z * length);
      correct(by_i, c * length);
      correct(by_o, -g / value_of(eta) * length);
    }
    length2 = x * x + y * y + z * z;
    const X inverse2 = X(1) / length2, inverse = sqrt(inverse2);
    r2 = (x * x + y * y) * inverse2;
    z2 = z * z * inverse2;
    cos_m = abs(by_i) * inverse;
    cos_o = abs(by_o) * inverse;
  }
};

/// D |m.wi| |m.wo| eta^2 / (|wi + eta wo|^2 cos_i): what visible micronormals of density d send to wo.
template <class X>
X refracted_flow(const scalar_t<X>& cos_i, const X& d, const Refraction<X>& g,
                 const uniform_t<X>& eta) {
  return d * g.cos_m * g.cos_o * (eta * eta) / (g.length2 * cos_i);
}

/// Whether a visible micronormal refracts wi to wo; sum = wi + eta wo.
template <class S>
mask_t<S> refracts_into(const Vec3<S>& wi, const Vec3<S>& wo, const Vec3<S>& sum, number_t<S> eta) {
  if (bends_nothing(eta)) return false;
  const S up = select(sum.z < S(0), S(-1), S(1));
  return (up * dot(sum, wi) > S(0)) & (up * dot(sum, wo) < S(0));
}

}  // namespace selenite
