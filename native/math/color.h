// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/scalar.h"

namespace selenite {

/// Three channels of linear Rec. 709; all arithmetic is per channel.
///
/// A ticked colour parameter is seeded *diagonally*: all three channels share one dual slot, and the
/// derivative of channel c in that slot is with respect to the parameter's own channel c.
template <class T>
struct Color {
  T r{}, g{}, b{};

  constexpr Color() = default;
  constexpr Color(T r, T g, T b) : r(r), g(g), b(b) {}
  explicit constexpr Color(T grey) : r(grey), g(grey), b(grey) {}
  template <class U>
  explicit constexpr Color(const Color<U>& c) : r(T(c.r)), g(T(c.g)), b(T(c.b)) {}

  constexpr T& operator[](int c) { return c == 0 ? r : (c == 1 ? g : b); }
  constexpr const T& operator[](int c) const { return c == 0 ? r : (c == 1 ? g : b); }

  constexpr Color& operator+=(const Color& o) { return *this = *this + o; }
  constexpr Color& operator*=(const Color& o) { return *this = *this * o; }

  friend bool operator==(const Color& a, const Color& b) requires(!kIsLanes<T>) = default;
  friend constexpr Color operator+(const Color& a, const Color& b) {
    return {a.r + b.r, a.g + b.g, a.b + b.b};
  }
  friend constexpr Color operator-(const Color& a, const Color& b) {
    return {a.r - b.r, a.g - b.g, a.b - b.b};
  }
  friend constexpr Color operator*(const Color& a, const Color& b) {
    return {a.r * b.r, a.g * b.g, a.b * b.b};
  }
  friend constexpr Color operator/(const Color& a, const Color& b) {
    return {a.r / b.r, a.g / b.g, a.b / b.b};
  }
};

/// Scaling; the factor may vary over the lanes while the colour does not.
template <class T, class S>
constexpr auto operator*(const Color<T>& a, const S& s) -> Color<decltype(a.r * s)> {
  return {a.r * s, a.g * s, a.b * s};
}
template <class T, class S>
constexpr auto operator/(const Color<T>& a, const S& s) -> Color<decltype(a.r / s)> {
  return {a.r / s, a.g / s, a.b / s};
}
/// Of a colour that all lanes share and one of each lane.
template <class A, class B>
  requires(!std::is_same_v<A, B>)
constexpr auto operator*(const Color<A>& a, const Color<B>& b) -> Color<decltype(a.r * b.r)> {
  return {a.r * b.r, a.g * b.g, a.b * b.b};
}

using Colorf = Color<float>;

template <class T>
constexpr Color<scalar_t<T>> value_of(const Color<T>& c) {
  return {value_of(c.r), value_of(c.g), value_of(c.b)};
}
template <class T>
constexpr bool has_slope(const Color<T>& c) {
  return has_slope(c.r) || has_slope(c.g) || has_slope(c.b);
}
template <class T>
constexpr T max_channel(const Color<T>& c) {
  return max(max(c.r, c.g), c.b);
}
template <class T>
constexpr T mean_channel(const Color<T>& c) {
  return (c.r + c.g + c.b) * (number_t<T>(1) / 3);
}
/// Per-channel function, one name for values and duals.
template <class T, class F>
constexpr auto map(const Color<T>& c, F&& f) -> Color<std::decay_t<decltype(f(c.r))>> {
  return {f(c.r), f(c.g), f(c.b)};
}
template <class M, class T>
  requires(std::is_same_v<M, mask_t<T>>&& kIsLanes<T>)
Color<T> select(const M& mask, const Color<T>& a, const Color<T>& b) {
  return {select(mask, a.r, b.r), select(mask, a.g, b.g), select(mask, a.b, b.b)};
}

}  // namespace selenite
