// SPDX-License-Identifier: GPL-3.0-or-later
#include "image/color/primaries.h"

#include <cmath>
#include <string>

#include "math/fault.h"

namespace selenite {
namespace {

constexpr Vector3 kConnectionWhite{0.9642, 1.0, 0.8249};  // D50 as ICC.1 rounds it
constexpr Matrix3 kBradford{
    {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

Matrix3 diagonal(const Vector3& v) { return {{{v[0], 0, 0}, {0, v[1], 0}, {0, 0, v[2]}}}; }

double determinant(const Matrix3& m) {
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

}  // namespace

Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) result[i][j] += a[i][k] * b[k][j];
  return result;
}

Vector3 product(const Matrix3& a, const Vector3& v) {
  Vector3 result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k) result[i] += a[i][k] * v[k];
  return result;
}

Matrix3 inverse(const Matrix3& m) {
  const double size = determinant(m);
  // Of matrices that files give; Rec. 709's is 0.2, those of the widest gamuts 0.5.
  constexpr double kSmallest = 1e-6;
  if (!(std::abs(size) > kSmallest) || !std::isfinite(size))
    throw Refused(
        "", "a colour matrix with determinant " + std::to_string(size) + " cannot be inverted");
  Matrix3 result{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
      result[i][j] = (m[a][c] * m[b][d] - m[a][d] * m[b][c]) / size;
    }
  }
  return result;
}

Vector3 xyz_of(const Chromaticity& white) {
  if (!(white.y > 0) || !std::isfinite(white.x) || !std::isfinite(white.y))
    throw Refused("", "a white with the chromaticity " + std::to_string(white.x) + ", " +
                          std::to_string(white.y) + " has no light");
  return {white.x / white.y, 1, (1 - white.x - white.y) / white.y};
}

Matrix3 to_xyz(const Primaries& primaries) {
  const auto column = [](const Chromaticity& c) { return Vector3{c.x, c.y, 1 - c.x - c.y}; };
  const Vector3 r = column(primaries.red), g = column(primaries.green), b = column(primaries.blue);
  const Matrix3 directions{{{r[0], g[0], b[0]}, {r[1], g[1], b[1]}, {r[2], g[2], b[2]}}};
  return product(directions, diagonal(product(inverse(directions), xyz_of(primaries.white))));
}

Matrix3 adaptation(const Vector3& from, const Vector3& to) {
  const Vector3 cones_from = product(kBradford, from), cones_to = product(kBradford, to);
  Vector3 ratio{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(cones_from[i] > 0))
      throw Refused("", "a white outside the colours of light cannot be adapted to");
    ratio[i] = cones_to[i] / cones_from[i];
  }
  return product(inverse(kBradford), product(diagonal(ratio), kBradford));
}

Matrix3 to_rec709(const Primaries& primaries, const Chromaticity& neutral) {
  const Matrix3 adapted = product(adaptation(xyz_of(neutral), xyz_of(kD65)), to_xyz(primaries));
  return product(rec709_of_xyz(), adapted);
}

Matrix3 rec709_of_xyz() { return inverse(to_xyz(kRec709)); }

Matrix3 rec709_of_connection_space() {
  return product(rec709_of_xyz(), adaptation(kConnectionWhite, xyz_of(kD65)));
}

bool nearly_equal(const Chromaticity& a, const Chromaticity& b) {
  constexpr double kRounding = 1e-3;
  return std::abs(a.x - b.x) <= kRounding && std::abs(a.y - b.y) <= kRounding;
}

bool nearly_equal(const Primaries& a, const Primaries& b) {
  return nearly_equal(a.red, b.red) && nearly_equal(a.green, b.green) &&
         nearly_equal(a.blue, b.blue) && nearly_equal(a.white, b.white);
}

}  // namespace selenite
