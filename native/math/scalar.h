// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <type_traits>

// Plain scalars behind the same names that dual numbers answer to, so that a lobe is written once.
namespace selenite {

/// The scalar that carries the value of T: float for float, float for Dual<float, N>.
template <class T>
struct ScalarOf {
  using type = T;
};
template <class T>
using scalar_t = typename ScalarOf<T>::type;

/// The mask that comparing two T gives: a bool, or a bool for each of the paths that are traced in
/// lockstep (lanes.h).
template <class S>
struct MaskOf {
  using type = bool;
};
template <class T>
using mask_t = typename MaskOf<scalar_t<T>>::type;
/// Whether T holds a number for each of several paths.
template <class T>
inline constexpr bool kIsLanes = !std::is_same_v<mask_t<T>, bool>;

constexpr bool any(bool mask) { return mask; }
constexpr bool all(bool mask) { return mask; }

/// What T is where all paths have the same: float for lanes, Dual<float, N> for duals of lanes, else T.
template <class T>
struct UniformOf {
  using type = T;
};
template <class T>
using uniform_t = typename UniformOf<T>::type;
/// The plain number behind T: float for lanes, for Dual<float, N> and for duals of lanes.
template <class T>
using number_t = scalar_t<uniform_t<T>>;

/// An index into a table for each number of T.
template <class S>
struct IndexOf {
  using type = int;
};
template <class T>
using index_t = typename IndexOf<scalar_t<T>>::type;

template <class T>
inline constexpr number_t<T> kPi = std::numbers::pi_v<number_t<T>>;
template <class T>
inline constexpr number_t<T> kInvPi = std::numbers::inv_pi_v<number_t<T>>;

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
