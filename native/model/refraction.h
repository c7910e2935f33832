// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/vec.h"
#include "model/narrow.h"

namespace selenite {

/// Micronormal geometry of a refraction, over any scalar: the half vector depends on eta. `drawn` is
/// the micronormal if it is known, more precisely than the directions give it back.
template <class X>
struct Refraction {
  using S = scalar_t<X>;

  X r2, z2, cos_m, cos_o, length2;  // squares of m; |m.wi|, |m.wo|; |wi + eta wo|^2

  Refraction(const Vec3<S>& wi, const Vec3<S>& wo, const X& eta, const Vec3<S>* drawn) {
    using std::abs, std::sqrt;
    X x = eta * wo.x + X(wi.x), y = eta * wo.y + X(wi.y), z = eta * wo.z + X(wi.z);
    const S cos_io = dot(wi, wo);
    X by_i = eta * cos_io + X(1), by_o = eta + X(cos_io);  // wi + eta wo times wi, wo
    if (drawn) {
      // wi + eta wo = m (c - g) cancels near eta = 1, and its rounding would be in the derivatives of
      // all that is divided by its length. Its own derivative does not cancel.
      const S c = dot(*drawn, wi), e = (value_of(eta) - 1) * (value_of(eta) + 1);
      const S g = safe_sqrt(e + c * c), length = -e / (c + g);
      x = with_value(x, drawn->x * length);
      y = with_value(y, drawn->y * length);
      z = with_value(z, drawn->z * length);
      by_i = with_value(by_i, c * length);
      by_o = with_value(by_o, -g / value_of(eta) * length);
    }
    length2 = x * x + y * y + z * z;
    const X inverse2 = X(1) / length2, inverse = sqrt(inverse2);
    r2 = (x * x + y * y) * inverse2;
    z2 = z * z * inverse2;
    cos_m = abs(by_i) * inverse;
    cos_o = abs(by_o) * inverse;
  }
};

}  // namespace selenite
