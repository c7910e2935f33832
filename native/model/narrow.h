// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <type_traits>

#include "math/dual.h"

// A lobe's shape depends on one or two numbers (width, index of refraction) whose duals carry a slot
// for every ticked parameter. Differentiating by those one or two and applying the chain rule once
// keeps the cost of a lobe almost independent of the number of parameters.
namespace selenite {

/// f(x). `f` is a generic callable that returns the type of its argument.
template <class T, class F>
T narrow(const T& x, F&& f) {
  using S = scalar_t<T>;
  if constexpr (std::is_same_v<T, S>) {
    return f(x);
  } else {
    if (!has_slope(x)) return T(f(x.v));
    const Dual<S, 1> y = f(Dual<S, 1>::variable(x.v, 0));
    return chain(x, y.v, y.d[0]);
  }
}

/// f(x, y), both arguments of one type.
template <class T, class F>
T narrow(const T& x, const T& y, F&& f) {
  using S = scalar_t<T>;
  if constexpr (std::is_same_v<T, S>) {
    return f(x, y);
  } else {
    const bool x_moves = has_slope(x), y_moves = has_slope(y);
    if (!x_moves && !y_moves) return T(f(x.v, y.v));
    using D = Dual<S, 1>;
    if (!y_moves) {
      const D z = f(D::variable(x.v, 0), D(y.v));
      return chain(x, z.v, z.d[0]);
    }
    if (!x_moves) {
      const D z = f(D(x.v), D::variable(y.v, 0));
      return chain(y, z.v, z.d[0]);
    }
    using D2 = Dual<S, 2>;
    const D2 z = f(D2::variable(x.v, 0), D2::variable(y.v, 1));
    return chain(x, z.v, z.d[0]) + chain(y, S(0), z.d[1]);
  }
}

/// Replaces the value and keeps the derivatives: for a value that is known more precisely than the
/// expression that carries its derivative.
template <class T>
T with_value(T x, scalar_t<T> value) {
  if constexpr (std::is_same_v<T, scalar_t<T>>) {
    return value;
  } else {
    x.v = value;
    return x;
  }
}

/// x limited to [0, 1]; at both ends included the derivative passes.
template <class T>
constexpr T clamp01(const T& x) {
  return clamp(x, scalar_t<T>(0), scalar_t<T>(1));
}

}  // namespace selenite
