// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"
#include "scene/shader/modes.h"

// Mapping and Vector Rotate.
namespace selenite::shading {

/// The rows of a rotation about x, then y, then z.
template <class T>
std::array<Vec3<T>, 3> rotation_rows(const Vec3<T>& angles) {
  const T sx = sine(angles.x), cx = cosine(angles.x), sy = sine(angles.y), cy = cosine(angles.y);
  const T sz = sine(angles.z), cz = cosine(angles.z);
  return {Vec3<T>{cy * cz, sy * sx * cz - cx * sz, sy * cx * cz + sx * sz},
          Vec3<T>{cy * sz, sy * sx * sz + cx * cz, sy * cx * sz - sx * cz},
          Vec3<T>{-sy, cy * sx, cy * cx}};
}
template <class T>
Vec3<T> turned(const std::array<Vec3<T>, 3>& rows, const Vec3<T>& v) {
  return {dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
}
template <class T>
Vec3<T> turned_back(const std::array<Vec3<T>, 3>& rows, const Vec3<T>& v) {
  return rows[0] * v.x + rows[1] * v.y + rows[2] * v.z;
}

template <class T>
Vec3<T> mapping(MappingMode mode, const Vec3<T>& v, const Vec3<T>& location, const Vec3<T>& angles,
                const Vec3<T>& scale) {
  const auto rows = rotation_rows(angles);
  const auto scaled_by = [](const Vec3<T>& a, const Vec3<T>& b) {
    return Vec3<T>{a.x * b.x, a.y * b.y, a.z * b.z};
  };
  const auto divided_by = [](const Vec3<T>& a, const Vec3<T>& b) {
    return Vec3<T>{safe_divide(a.x, b.x), safe_divide(a.y, b.y), safe_divide(a.z, b.z)};
  };
  switch (mode) {
    case MappingMode::kPoint:
      return turned(rows, scaled_by(v, scale)) + location;
    case MappingMode::kTexture:
      return divided_by(turned_back(rows, v - location), scale);
    case MappingMode::kVector:
      return turned(rows, scaled_by(v, scale));
    case MappingMode::kNormal:
      return safe_normalize(turned(rows, divided_by(v, scale)));
  }
  return v;
}

/// About a unit axis; an axis of no length turns nothing.
template <class T>
Vec3<T> rotated(const Vec3<T>& v, const Vec3<T>& axis, const T& angle) {
  const T s = sine(angle), c = cosine(angle);
  const Vec3<T> n = safe_normalize(axis);
  if (value_of(dot(n, n)) == 0) return v;
  return v * c + cross(n, v) * s + n * (dot(n, v) * (T(1) - c));
}

template <class T>
Vec3<T> vector_rotate(RotateMode mode, bool inverted, const Vec3<T>& v, const Vec3<T>& center,
                      const Vec3<T>& axis, const T& angle, const Vec3<T>& angles) {
  const T signed_angle = inverted ? -angle : angle;
  const Vec3<T> from = v - center;
  const T zero(0), one(1);
  switch (mode) {
    case RotateMode::kAxis:
      return rotated(from, axis, signed_angle) + center;
    case RotateMode::kX:
      return rotated(from, Vec3<T>{one, zero, zero}, signed_angle) + center;
    case RotateMode::kY:
      return rotated(from, Vec3<T>{zero, one, zero}, signed_angle) + center;
    case RotateMode::kZ:
      return rotated(from, Vec3<T>{zero, zero, one}, signed_angle) + center;
    case RotateMode::kEuler: {
      const auto rows = rotation_rows(angles);
      return (inverted ? turned_back(rows, from) : turned(rows, from)) + center;
    }
  }
  return v;
}

}  // namespace selenite::shading
