// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <type_traits>

#include "math/gradient.h"
#include "math/scalar.h"

namespace selenite {

/// First-order dual number: value `v`, derivatives `d[k] = dv/dp_k`.
///
/// With p_k = (x_k, 1) in slot k, any expression f(p) computed with these numbers carries its exact
/// gradient along: (a + a'e)(b + b'e) = ab + (a'b + ab')e, because e^2 = 0.
/// N counts the ticked parameters of ONE model (below ten), never the unknowns of a fit.
template <class S, int N>
struct Dual {
  S v{};
  Gradient<S, N> d{};

  constexpr Dual() = default;
  constexpr Dual(S value) : v(value) {}  // NOLINT(google-explicit-constructor): constants are duals
  constexpr Dual(S value, const Gradient<S, N>& slopes) : v(value), d(slopes) {}
  /// The k-th independent variable.
  static constexpr Dual variable(S value, int k) {
    Dual x(value);
    x.d[k] = 1;
    return x;
  }

  constexpr Dual& operator+=(const Dual& o) { return *this = *this + o; }
  constexpr Dual& operator-=(const Dual& o) { return *this = *this - o; }
  constexpr Dual& operator*=(const Dual& o) { return *this = *this * o; }
  constexpr Dual& operator/=(const Dual& o) { return *this = *this / o; }

  friend constexpr Dual operator-(const Dual& a) { return {-a.v, -a.d}; }
  friend constexpr Dual operator+(const Dual& a, const Dual& b) { return {a.v + b.v, a.d + b.d}; }
  friend constexpr Dual operator-(const Dual& a, const Dual& b) { return {a.v - b.v, a.d - b.d}; }
  friend constexpr Dual operator*(const Dual& a, const Dual& b) {
    return {a.v * b.v, a.d * b.v + b.d * a.v};
  }
  friend constexpr Dual operator/(const Dual& a, const Dual& b) {
    const S inverse = S(1) / b.v, ratio = a.v * inverse;
    return {ratio, (a.d - b.d * ratio) * inverse};
  }
  // Constants: a product with a plain number costs N multiplications less.
  friend constexpr Dual operator+(const Dual& a, S b) { return {a.v + b, a.d}; }
  friend constexpr Dual operator+(S a, const Dual& b) { return b + a; }
  friend constexpr Dual operator-(const Dual& a, S b) { return a + (-b); }
  friend constexpr Dual operator-(S a, const Dual& b) { return -b + a; }
  friend constexpr Dual operator*(const Dual& a, S b) { return {a.v * b, a.d * b}; }
  friend constexpr Dual operator*(S a, const Dual& b) { return b * a; }
  friend constexpr Dual operator/(const Dual& a, S b) { return a * (S(1) / b); }
  friend constexpr Dual operator/(S a, const Dual& b) { return Dual(a) / b; }

  // Order is that of the values: a branch is taken as the primal takes it.
  friend constexpr bool operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
  friend constexpr bool operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
  friend constexpr bool operator<=(const Dual& a, const Dual& b) { return a.v <= b.v; }
  friend constexpr bool operator>=(const Dual& a, const Dual& b) { return a.v >= b.v; }
};

template <class S, int N>
struct ScalarOf<Dual<S, N>> {
  using type = S;
};
template <class S, int N>
constexpr S value_of(const Dual<S, N>& x) {
  return x.v;
}
template <class S, int N>
constexpr bool has_slope(const Dual<S, N>& x) {
  return any(x.d);
}

/// Chain rule: y = f(x) with f(x.v) = value and f'(x.v) = slope. A slot without derivative stays
/// exactly zero even where the slope is infinite (0 * inf would be NaN).
template <class S, int N>
constexpr Dual<S, N> chain(const Dual<S, N>& x, S value, S slope) {
  return {value, scaled(x.d, slope)};
}

template <class S, int N>
Dual<S, N> sqrt(const Dual<S, N>& x) {
  const S root = std::sqrt(x.v);
  return chain(x, root, S(0.5) / root);
}
/// sqrt of max(x, 0): value and derivative 0 at and below zero, as for the plain scalar.
template <class S, int N>
Dual<S, N> safe_sqrt(const Dual<S, N>& x) {
  return x.v > 0 ? sqrt(x) : Dual<S, N>(0);
}
template <class S, int N>
Dual<S, N> exp(const Dual<S, N>& x) {
  const S e = std::exp(x.v);
  return chain(x, e, e);
}
template <class S, int N>
Dual<S, N> log(const Dual<S, N>& x) {
  return chain(x, std::log(x.v), S(1) / x.v);
}
template <class S, int N>
Dual<S, N> sin(const Dual<S, N>& x) {
  return chain(x, std::sin(x.v), std::cos(x.v));
}
template <class S, int N>
Dual<S, N> cos(const Dual<S, N>& x) {
  return chain(x, std::cos(x.v), -std::sin(x.v));
}
template <class S, int N>
Dual<S, N> tan(const Dual<S, N>& x) {
  const S t = std::tan(x.v);
  return chain(x, t, S(1) + t * t);
}
template <class S, int N>
Dual<S, N> atan(const Dual<S, N>& x) {
  return chain(x, std::atan(x.v), S(1) / (S(1) + x.v * x.v));
}
/// x to a constant power.
template <class S, int N>
Dual<S, N> pow(const Dual<S, N>& x, std::type_identity_t<S> exponent) {
  return chain(x, std::pow(x.v, exponent), exponent * std::pow(x.v, exponent - S(1)));
}
template <class S, int N>
constexpr Dual<S, N> abs(const Dual<S, N>& x) {
  return x.v < 0 ? -x : x;
}
template <class S, int N>
constexpr Dual<S, N> max(const Dual<S, N>& a, const Dual<S, N>& b) {
  return a.v < b.v ? b : a;
}
template <class S, int N>
constexpr Dual<S, N> min(const Dual<S, N>& a, const Dual<S, N>& b) {
  return b.v < a.v ? b : a;
}
/// Inside [lo, hi], both ends included, the derivative passes: a parameter that a box constraint
/// has put on its bound keeps its one-sided derivative.
template <class S, int N>
constexpr Dual<S, N> clamp(const Dual<S, N>& x, std::type_identity_t<S> lo,
                           std::type_identity_t<S> hi) {
  if (x.v < lo) return Dual<S, N>(lo);
  if (x.v > hi) return Dual<S, N>(hi);
  return x;
}

}  // namespace selenite
