// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <tuple>
#include <type_traits>

#include "math/dual.h"

// A lobe's shape depends on one or two numbers (width, index of refraction) whose duals carry a slot
// for every ticked parameter. Differentiating by those one or two and applying the chain rule once
// keeps the cost of a lobe almost independent of the number of parameters.
namespace selenite {

/// T with the values V instead of its own: what a function of T gives that meets lanes inside.
template <class T, class V>
struct WithValues {
  using type = V;
};
template <class S, int N, class V>
struct WithValues<Dual<S, N>, V> {
  using type = Dual<V, N>;
};
template <class T, class V>
using with_values_t = typename WithValues<T, V>::type;

/// f(x). `f` is a generic callable that returns the type of its argument, or that over lanes if it
/// meets numbers that differ from lane to lane.
template <class T, class F>
auto narrow(const T& x, F&& f) {
  using S = scalar_t<T>;
  if constexpr (std::is_same_v<T, S>) {
    return f(x);
  } else {
    using R = with_values_t<T, decltype(f(x.v))>;
    if (!has_slope(x)) return R(f(x.v));
    const auto y = f(Dual<S, 1>::variable(x.v, 0));
    return chain(x, y.v, y.d[0]);
  }
}

/// Several functions of (x, y) at once, both arguments of one type; `f` returns a std::array.
template <class T, class F>
auto narrow_all(const T& x, const T& y, F&& f) {
  using S = scalar_t<T>;
  if constexpr (std::is_same_v<T, S>) {
    return f(x, y);
  } else {
    using Outputs = decltype(f(x.v, y.v));
    constexpr std::size_t kOutputs = std::tuple_size_v<Outputs>;
    using V = typename Outputs::value_type;
    using R = with_values_t<T, V>;
    std::array<R, kOutputs> result;
    const bool x_moves = has_slope(x), y_moves = has_slope(y);
    if (!x_moves && !y_moves) {
      const auto z = f(x.v, y.v);
      for (std::size_t i = 0; i < kOutputs; ++i) result[i] = R(z[i]);
    } else if (x_moves && y_moves) {
      using D = Dual<S, 2>;
      const auto z = f(D::variable(x.v, 0), D::variable(y.v, 1));
      for (std::size_t i = 0; i < kOutputs; ++i)
        result[i] = chain(x, z[i].v, z[i].d[0]) + chain(y, V(0), z[i].d[1]);
    } else {
      using D = Dual<S, 1>;
      const auto z = x_moves ? f(D::variable(x.v, 0), D(y.v)) : f(D(x.v), D::variable(y.v, 0));
      for (std::size_t i = 0; i < kOutputs; ++i)
        result[i] = chain(x_moves ? x : y, z[i].v, z[i].d[0]);
    }
    return result;
  }
}

/// f(x, y), both arguments of one type.
template <class T, class F>
auto narrow(const T& x, const T& y, F&& f) {
  return narrow_all(x, y, [&](const auto& a, const auto& b) { return std::array{f(a, b)}; })[0];
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
