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
  /// What all lanes have alike, as lanes.
  template <class U>
    requires(!std::is_same_v<U, S> && std::is_same_v<U, uniform_t<S>>)
  Dual(const Dual<U, N>& uniform) : v(uniform.v) {  // NOLINT(google-explicit-constructor)
    for (int k = 0; k < N; ++k) d[k] = S(uniform.d[k]);
  }
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

  // With a number that varies over the lanes where this one does not.
  template <class B>
  static constexpr bool varies = !std::is_same_v<B, S> && std::is_same_v<uniform_t<B>, S>;
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator+(const Dual& a, const B& b) { return Dual<B, N>(a) + b; }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator+(const B& a, const Dual& b) { return a + Dual<B, N>(b); }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator-(const Dual& a, const B& b) { return Dual<B, N>(a) - b; }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator-(const B& a, const Dual& b) { return a - Dual<B, N>(b); }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator*(const Dual& a, const B& b) { return Dual<B, N>(a) * b; }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator*(const B& a, const Dual& b) { return a * Dual<B, N>(b); }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator/(const Dual& a, const B& b) { return Dual<B, N>(a) / b; }
  template <class B>
    requires(varies<B>)
  friend Dual<B, N> operator/(const B& a, const Dual& b) { return a / Dual<B, N>(b); }

  // Order is that of the values: a branch is taken as the primal takes it.
  friend constexpr mask_t<S> operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
  friend constexpr mask_t<S> operator>(const Dual& a, const Dual& b) { return a.v > b.v; }
  friend constexpr mask_t<S> operator<=(const Dual& a, const Dual& b) { return a.v <= b.v; }
  friend constexpr mask_t<S> operator>=(const Dual& a, const Dual& b) { return a.v >= b.v; }
};

template <class S, int N>
struct ScalarOf<Dual<S, N>> {
  using type = S;
};
template <class S, int N>
struct UniformOf<Dual<S, N>> {
  using type = Dual<uniform_t<S>, N>;
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
/// The same where all lanes have the same x.
template <class S, int N, class V>
  requires(!std::is_same_v<V, S> && std::is_same_v<uniform_t<V>, S>)
Dual<V, N> chain(const Dual<S, N>& x, const V& value, const V& slope) {
  Dual<V, N> y(value);
  for (int k = 0; k < N; ++k)
    if (x.d[k] != 0) y.d[k] = slope * V(x.d[k]);
  return y;
}
/// From `a` the value and all derivatives where the mask is set, else from `b`: nothing of the other
/// side is left, not even what is not finite.
template <class M, class S, int N>
  requires(std::is_same_v<M, mask_t<S>>&& kIsLanes<S>)
Dual<S, N> select(const M& mask, const Dual<S, N>& a, const Dual<S, N>& b) {
  return {select(mask, a.v, b.v), Gradient<S, N>::each(a.d, b.d, [&mask](const S& x, const S& y) {
            return select(mask, x, y);
          })};
}

template <class S, int N>
Dual<S, N> sqrt(const Dual<S, N>& x) {
  using std::sqrt;
  const S root = sqrt(x.v);
  return chain(x, root, S(S(0.5) / root));
}
/// sqrt of max(x, 0): value and derivative 0 at and below zero, as for the plain scalar.
template <class S, int N>
Dual<S, N> safe_sqrt(const Dual<S, N>& x) {
  const mask_t<S> positive = x.v > S(0);
  if (!any(positive)) return Dual<S, N>(0);
  return select(positive, sqrt(x), Dual<S, N>(0));
}
template <class S, int N>
Dual<S, N> exp(const Dual<S, N>& x) {
  using std::exp;
  const S e = exp(x.v);
  return chain(x, e, e);
}
template <class S, int N>
Dual<S, N> log(const Dual<S, N>& x) {
  using std::log;
  return chain(x, S(log(x.v)), S(S(1) / x.v));
}
template <class S, int N>
Dual<S, N> sin(const Dual<S, N>& x) {
  using std::sin, std::cos;
  return chain(x, S(sin(x.v)), S(cos(x.v)));
}
template <class S, int N>
Dual<S, N> cos(const Dual<S, N>& x) {
  using std::sin, std::cos;
  return chain(x, S(cos(x.v)), S(-sin(x.v)));
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
  return select(x.v < S(0), -x, x);
}
template <class S, int N>
constexpr Dual<S, N> max(const Dual<S, N>& a, const Dual<S, N>& b) {
  return select(a.v < b.v, b, a);
}
template <class S, int N>
constexpr Dual<S, N> min(const Dual<S, N>& a, const Dual<S, N>& b) {
  return select(b.v < a.v, b, a);
}
/// Inside [lo, hi], both ends included, the derivative passes: a parameter that a box constraint
/// has put on its bound keeps its one-sided derivative.
template <class S, int N>
constexpr Dual<S, N> clamp(const Dual<S, N>& x, std::type_identity_t<S> lo,
                           std::type_identity_t<S> hi) {
  const mask_t<S> below = x.v<lo, above = x.v> hi;
  if (!any(below | above)) return x;
  return select(below, Dual<S, N>(lo), select(above, Dual<S, N>(hi), x));
}

}  // namespace selenite
