// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <type_traits>

#include "math/dual.h"

namespace selenite {

/// A number with its derivatives by the two angles by which a normal tilts. Unlike a dual number it is
/// a scalar of its own: the same code takes directions, cosines and parameters of this type.
template <class S>
class Tilted {
 public:
  constexpr Tilted() = default;
  template <class Number>
    requires std::is_arithmetic_v<Number>
  // NOLINTNEXTLINE(google-explicit-constructor): constants are tilted numbers
  constexpr Tilted(Number value) : x_(static_cast<S>(value)) {}
  constexpr explicit Tilted(const Dual<S, 2>& x) : x_(x) {}
  constexpr Tilted(S value, S by_first, S by_second) : x_(value) {
    x_.d[0] = by_first;
    x_.d[1] = by_second;
  }

  constexpr const Dual<S, 2>& dual() const { return x_; }
  constexpr S value() const { return x_.v; }
  constexpr S slope(int k) const { return x_.d[k]; }
  explicit constexpr operator int() const { return static_cast<int>(x_.v); }

  constexpr Tilted& operator+=(const Tilted& o) { return *this = *this + o; }
  constexpr Tilted& operator-=(const Tilted& o) { return *this = *this - o; }
  constexpr Tilted& operator*=(const Tilted& o) { return *this = *this * o; }
  constexpr Tilted& operator/=(const Tilted& o) { return *this = *this / o; }

  friend constexpr Tilted operator-(const Tilted& a) { return Tilted(-a.x_); }
  friend constexpr Tilted operator+(const Tilted& a, const Tilted& b) {
    return Tilted(a.x_ + b.x_);
  }
  friend constexpr Tilted operator-(const Tilted& a, const Tilted& b) {
    return Tilted(a.x_ - b.x_);
  }
  friend constexpr Tilted operator*(const Tilted& a, const Tilted& b) {
    return Tilted(a.x_ * b.x_);
  }
  friend constexpr Tilted operator/(const Tilted& a, const Tilted& b) {
    return Tilted(a.x_ / b.x_);
  }
  friend constexpr bool operator==(const Tilted& a, const Tilted& b) { return a.x_.v == b.x_.v; }
  friend constexpr bool operator<(const Tilted& a, const Tilted& b) { return a.x_.v < b.x_.v; }
  friend constexpr bool operator>(const Tilted& a, const Tilted& b) { return a.x_.v > b.x_.v; }
  friend constexpr bool operator<=(const Tilted& a, const Tilted& b) { return a.x_.v <= b.x_.v; }
  friend constexpr bool operator>=(const Tilted& a, const Tilted& b) { return a.x_.v >= b.x_.v; }

 private:
  Dual<S, 2> x_;
};

template <class T>
inline constexpr bool kIsTilted = false;
template <class S>
inline constexpr bool kIsTilted<Tilted<S>> = true;

template <class S>
inline constexpr S kPi<Tilted<S>> = std::numbers::pi_v<S>;
template <class S>
inline constexpr S kInvPi<Tilted<S>> = std::numbers::inv_pi_v<S>;

template <class S>
constexpr const Tilted<S>& value_of(const Tilted<S>& x) {
  return x;
}
/// Of the parameters: none. Those by the normal are part of the number.
template <class S>
constexpr bool has_slope(const Tilted<S>&) {
  return false;
}

template <class S>
Tilted<S> sqrt(const Tilted<S>& x) {
  return Tilted<S>(sqrt(x.dual()));
}
template <class S>
Tilted<S> safe_sqrt(const Tilted<S>& x) {
  return Tilted<S>(safe_sqrt(x.dual()));
}
template <class S>
Tilted<S> exp(const Tilted<S>& x) {
  return Tilted<S>(exp(x.dual()));
}
template <class S>
Tilted<S> log(const Tilted<S>& x) {
  return Tilted<S>(log(x.dual()));
}
template <class S>
Tilted<S> log1p(const Tilted<S>& x) {
  return Tilted<S>(chain(x.dual(), std::log1p(x.value()), 1 / (1 + x.value())));
}
template <class S>
Tilted<S> cos(const Tilted<S>& x) {
  return Tilted<S>(cos(x.dual()));
}
template <class S>
Tilted<S> acos(const Tilted<S>& x) {
  // The slope at an angle of 0 has no limit; where the angle counts, its sine is a factor.
  const S c = x.value(), sine = std::sqrt(std::max((1 - c) * (1 + c), S(1e-12)));
  return Tilted<S>(chain(x.dual(), std::acos(c), -1 / sine));
}
template <class S>
Tilted<S> pow(const Tilted<S>& x, const Tilted<S>& y) {
  return x.value() > 0 ? exp(y * log(x)) : Tilted<S>(std::pow(x.value(), y.value()));
}
template <class S>
constexpr Tilted<S> abs(const Tilted<S>& x) {
  return x < 0 ? -x : x;
}
template <class S>
Tilted<S> copysign(const Tilted<S>& x, const Tilted<S>& y) {
  return Tilted<S>(std::signbit(x.value()) == std::signbit(y.value()) ? x.dual() : -x.dual());
}
template <class S>
constexpr Tilted<S> max(const Tilted<S>& a, const std::type_identity_t<Tilted<S>>& b) {
  return a < b ? b : a;
}
template <class S>
constexpr Tilted<S> min(const Tilted<S>& a, const std::type_identity_t<Tilted<S>>& b) {
  return b < a ? b : a;
}
template <class S>
constexpr Tilted<S> clamp(const Tilted<S>& x, const std::type_identity_t<Tilted<S>>& lo,
                          const std::type_identity_t<Tilted<S>>& hi) {
  return x < lo ? lo : (x > hi ? hi : x);
}

}  // namespace selenite
