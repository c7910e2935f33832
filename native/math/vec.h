// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>

#include "math/scalar.h"

namespace selenite {

/// Vector or point in three dimensions over any scalar (float, double, Dual).
template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  constexpr Vec3() = default;
  constexpr Vec3(T x, T y, T z) : x(x), y(y), z(z) {}
  template <class U>
  explicit constexpr Vec3(const Vec3<U>& v) : x(T(v.x)), y(T(v.y)), z(T(v.z)) {}

  constexpr Vec3& operator+=(const Vec3& o) { return *this = *this + o; }

  friend constexpr Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

/// Scaling; the factor may be a dual while the vector is not, and the other way round.
template <class T, class S>
constexpr auto operator*(const Vec3<T>& v, const S& s) {
  using R = decltype(v.x * s);
  return Vec3<R>{v.x * s, v.y * s, v.z * s};
}
template <class T, class S>
constexpr auto operator/(const Vec3<T>& v, const S& s) {
  return v * (scalar_t<T>(1) / s);
}
template <class A, class B>
constexpr auto dot(const Vec3<A>& a, const Vec3<B>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T length(const Vec3<T>& v) {
  using std::sqrt;
  return sqrt(dot(v, v));
}
template <class T>
Vec3<T> normalize(const Vec3<T>& v) {
  return v / length(v);
}
template <class M, class T>
  requires(std::is_same_v<M, mask_t<T>>&& kIsLanes<T>)
Vec3<T> select(const M& mask, const Vec3<T>& a, const Vec3<T>& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

template <class T>
struct Vec2 {
  T x{}, y{};
  friend constexpr Vec2 operator+(const Vec2& a, const Vec2& b) { return {a.x + b.x, a.y + b.y}; }
  friend constexpr Vec2 operator*(const Vec2& a, T s) { return {a.x * s, a.y * s}; }
};
using Vec2f = Vec2<float>;

/// Right-handed orthonormal frame with `n` as its z axis.
/// Source: Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
template <class T>
struct Frame {
  Vec3<T> s, t, n;

  static Frame from_normal(const Vec3<T>& n) {
    using std::copysign;
    const T sign = copysign(T(1), n.z);
    const T a = T(-1) / (sign + n.z);
    const T b = n.x * n.y * a;
    return {
        {T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
  }
  Vec3<T> to_local(const Vec3<T>& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3<T> to_world(const Vec3<T>& v) const { return s * v.x + t * v.y + n * v.z; }
};

}  // namespace selenite
