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
    const X x = eta * wo.x + X(wi.x), y = eta * wo.y + X(wi.y), z = eta * wo.z + X(wi.z);
    const S cos_io = dot(wi, wo);
    length2 = x * x + y * y + z * z;
    const X inverse2 = X(1) / length2, inverse = sqrt(inverse2);
    r2 = (x * x + y * y) * inverse2;
    z2 = z * z * inverse2;
    cos_m = abs(eta * cos_io + X(1)) * inverse;
    cos_o = abs(eta + X(cos_io)) * inverse;
    if (drawn) {
      const S c = dot(*drawn, wi), e = (value_of(eta) - 1) * (value_of(eta) + 1);
      const S g = safe_sqrt(e + c * c);
      r2 = with_value(r2, drawn->x * drawn->x + drawn->y * drawn->y);
      z2 = with_value(z2, drawn->z * drawn->z);
      cos_m = with_value(cos_m, c);
      cos_o = with_value(cos_o, g / value_of(eta));
      length2 = with_value(length2, square(e / (c + g)));  // wi + eta wo = m (c - g)
    }
  }
};

}  // namespace selenite
