// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

// Plain scalars behind the same names that dual numbers answer to, so that a lobe is written once.
namespace selenite {

template <class T>
inline constexpr T kPi = std::numbers::pi_v<T>;
template <class T>
inline constexpr T kInvPi = std::numbers::inv_pi_v<T>;

/// The scalar that carries the value of T: float for float, float for Dual<float, N>.
template <class T>
struct ScalarOf {
  using type = T;
};
template <class T>
using scalar_t = typename ScalarOf<T>::type;

template <class T>
  requires std::is_floating_point_v<T>
constexpr T value_of(T x) { return x; }
/// True when some derivative is carried and not zero.
template <class T>
  requires std::is_floating_point_v<T>
constexpr bool has_slope(T) { return false; }
template <class T>
constexpr T square(const T& x) {
  return x * x;
}
template <class T>
constexpr T select(bool condition, const T& a, const T& b) {
  return condition ? a : b;
}
template <class T>
  requires std::is_floating_point_v<T>
constexpr T clamp(T x, scalar_t<T> lo, scalar_t<T> hi) { return x < lo ? lo : (x > hi ? hi : x); }
template <class T>
  requires std::is_floating_point_v<T>
constexpr T max(T a, T b) { return a < b ? b : a; }
template <class T>
  requires std::is_floating_point_v<T>
constexpr T min(T a, T b) { return b < a ? b : a; }
/// sqrt that takes rounding below zero as zero.
template <class T>
  requires std::is_floating_point_v<T> T safe_sqrt(T x) { return std::sqrt(x > 0 ? x : T(0)); }

}  // namespace selenite
