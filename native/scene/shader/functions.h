// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

#include "math/color.h"
#include "math/dual.h"
#include "math/vec.h"

// Functions of one number, or of two, of which the derivative is known: for plain numbers and duals.
namespace selenite::shading {

/// f(x) with f(x) = value and f'(x) = slope.
template <class T>
T of_one(const T& x, scalar_t<T> value, scalar_t<T> slope) {
  if constexpr (std::is_floating_point_v<T>) {
    (void)x, (void)slope;
    return value;
  } else {
    return chain(x, value, slope);
  }
}
/// f(a, b) with its two partial derivatives.
template <class T>
T of_two(const T& a, const T& b, scalar_t<T> value, scalar_t<T> by_a, scalar_t<T> by_b) {
  if constexpr (std::is_floating_point_v<T>) {
    (void)a, (void)b, (void)by_a, (void)by_b;
    return value;
  } else {
    return T(value, scaled(a.d, by_a) + scaled(b.d, by_b));
  }
}

template <class T>
T constant(double value) {
  return T(static_cast<scalar_t<T>>(value));
}
template <class T>
scalar_t<T> floor_of(const T& x) {
  return std::floor(value_of(x));
}
template <class T>
T fraction(const T& x) {
  return x - floor_of(x);
}
template <class T>
T absolute(const T& x) {
  return value_of(x) < 0 ? -x : x;
}
template <class T>
T saturate(const T& x) {
  return clamp(x, scalar_t<T>(0), scalar_t<T>(1));
}
template <class T>
T lerp(const T& a, const T& b, const T& t) {
  return a + t * (b - a);
}
template <class T>
T safe_divide(const T& a, const T& b) {
  return value_of(b) != 0 ? a / b : T(0);
}
/// 0 where a real power does not exist.
template <class T>
T safe_power(const T& a, const T& b) {
  using S = scalar_t<T>;
  const S x = value_of(a), y = value_of(b);
  if (x < 0 && y != std::trunc(y)) return T(0);
  const S value = std::pow(x, y);
  if constexpr (std::is_floating_point_v<T>) return value;
  const S by_a = y == 0 ? S(0) : y * std::pow(x, y - 1);
  return of_two(a, b, value, by_a, x > 0 ? value * std::log(x) : S(0));
}
template <class T>
T sine(const T& x) {
  return of_one(x, std::sin(value_of(x)), std::cos(value_of(x)));
}
template <class T>
T cosine(const T& x) {
  return of_one(x, std::cos(value_of(x)), -std::sin(value_of(x)));
}
template <class T>
T tangent(const T& x) {
  const scalar_t<T> t = std::tan(value_of(x));
  return of_one(x, t, 1 + t * t);
}
template <class T>
T exp_of(const T& x) {
  const scalar_t<T> e = std::exp(value_of(x));
  return of_one(x, e, e);
}
/// 0 where x <= 0.
template <class T>
T safe_log(const T& x) {
  if (!(value_of(x) > 0)) return T(0);
  return of_one(x, std::log(value_of(x)), 1 / value_of(x));
}
template <class T>
T arc_tangent2(const T& y, const T& x) {
  using S = scalar_t<T>;
  const S a = value_of(y), b = value_of(x), square = a * a + b * b;
  if (square == 0) return T(0);
  return of_two(y, x, std::atan2(a, b), b / square, -a / square);
}
/// Of x cut off to [-1, 1].
template <class T>
T arc_cosine(const T& x) {
  using S = scalar_t<T>;
  const S v = std::clamp(value_of(x), S(-1), S(1)), root = 1 - v * v;
  return of_one(x, std::acos(v), root > 0 ? -1 / std::sqrt(root) : S(0));
}
template <class T>
T modulo(const T& a, const T& b) {
  const auto x = value_of(a), y = value_of(b);
  if (y == 0) return T(0);
  return of_two(a, b, std::fmod(x, y), scalar_t<T>(1), -std::trunc(x / y));
}
template <class T>
T wrap(const T& x, const T& high, const T& low) {
  const T range = high - low;
  if (value_of(range) == 0) return low;
  return x - range * floor_of((x - low) / range);
}

template <class T>
Vec3<T> vector_of(const Color<T>& c) {
  return {c.r, c.g, c.b};
}
template <class T>
Color<T> color_of(const Vec3<T>& v) {
  return {v.x, v.y, v.z};
}
template <class T, class U>
Color<T> lifted(const Color<U>& c) {
  return {T(static_cast<scalar_t<T>>(c.r)), T(static_cast<scalar_t<T>>(c.g)),
          T(static_cast<scalar_t<T>>(c.b))};
}
template <class T>
Color<T> lifted(const Vec3f& v) {
  return lifted<T>(Colorf{v.x, v.y, v.z});
}
/// Zero where the vector has no direction.
template <class T>
Vec3<T> safe_normalize(const Vec3<T>& v) {
  const T square = dot(v, v);
  return value_of(square) > 0 ? v / safe_sqrt(square) : Vec3<T>{};
}
/// f(a, b) a channel each.
template <class T, class F>
Color<T> each(const Color<T>& a, const Color<T>& b, F&& f) {
  return {f(a.r, b.r), f(a.g, b.g), f(a.b, b.b)};
}
template <class T, class F>
Color<T> each(const Color<T>& a, const Color<T>& b, const Color<T>& c, F&& f) {
  return {f(a.r, b.r, c.r), f(a.g, b.g, c.g), f(a.b, b.b, c.b)};
}

}  // namespace selenite::shading
