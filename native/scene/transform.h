// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

#include "math/vec.h"

namespace selenite {

/// Affine map, row-major 3x4 in double: object space to world space, column vectors as in Blender.
struct Transform {
  std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

  Vec3d column(int j) const { return {m[0][j], m[1][j], m[2][j]}; }
  Vec3d translation() const { return column(3); }
  /// D: double, or doubles in lanes.
  template <class D>
  Vec3<D> vector(const Vec3<D>& v) const {
    return column(0) * v.x + column(1) * v.y + column(2) * v.z;
  }
  template <class D>
  Vec3<D> point(const Vec3<D>& p) const {
    return vector(p) + Vec3<D>(translation());
  }
  /// Normal by the cofactor matrix (inverse transpose times determinant); not normalised. Keeps the
  /// side of the surface where the determinant is positive.
  Vec3d normal(const Vec3d& n) const {
    const Vec3d a = column(0), b = column(1), c = column(2);
    return cross(b, c) * n.x + cross(c, a) * n.y + cross(a, b) * n.z;
  }
  /// Of a map with a determinant other than 0.
  Transform inverse() const {
    const Vec3d a = column(0), b = column(1), c = column(2), t = translation();
    const double scale = 1 / determinant();
    const Vec3d rows[3] = {cross(b, c) * scale, cross(c, a) * scale, cross(a, b) * scale};
    Transform result;
    for (int i = 0; i < 3; ++i) result.m[i] = {rows[i].x, rows[i].y, rows[i].z, -dot(rows[i], t)};
    return result;
  }
  double determinant() const { return dot(cross(column(0), column(1)), column(2)); }

  void translate(const Vec3d& t) {
    m[0][3] += t.x;
    m[1][3] += t.y;
    m[2][3] += t.z;
  }
};

}  // namespace selenite
