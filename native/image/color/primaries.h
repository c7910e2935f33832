// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>

namespace selenite {

using Vector3 = std::array<double, 3>;
using Matrix3 = std::array<Vector3, 3>;  // rows

inline constexpr Matrix3 kIdentity3{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

Matrix3 product(const Matrix3& a, const Matrix3& b);
Vector3 product(const Matrix3& a, const Vector3& v);
/// Throws InvalidArgument when `m` cannot be inverted.
Matrix3 inverse(const Matrix3& m);

/// CIE 1931 chromaticity (x, y).
struct Chromaticity {
  double x, y;
  bool operator==(const Chromaticity&) const = default;
};

/// What R, G, B and R = G = B mean.
struct Primaries {
  Chromaticity red, green, blue, white;
  bool operator==(const Primaries&) const = default;
};

inline constexpr Chromaticity kD65{0.3127, 0.3290};
inline constexpr Primaries kRec709{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65};
inline constexpr Primaries kAdobeRgb{{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, kD65};

/// XYZ of a linear colour, where the white has Y = 1. Source: SMPTE RP 177. Throws InvalidArgument
/// when the primaries span no triangle.
Matrix3 to_xyz(const Primaries& primaries);

/// XYZ as seen under `to`, of XYZ seen under `from`. Source: Bradford matrix, ICC.1:2022 annex E.
Matrix3 adaptation(const Vector3& from, const Vector3& to);

/// XYZ with Y = 1.
Vector3 xyz_of(const Chromaticity& white);

/// Linear Rec. 709 of a linear colour; `neutral` (usually the white) becomes R = G = B.
Matrix3 to_rec709(const Primaries& primaries, const Chromaticity& neutral);
/// Of absolute XYZ, without adaptation.
Matrix3 rec709_of_xyz();
/// Of XYZ in the profile connection space of ICC, whose white is D50.
Matrix3 rec709_of_connection_space();

/// Equal as far as files round: to a thousandth.
bool nearly_equal(const Primaries& a, const Primaries& b);
bool nearly_equal(const Chromaticity& a, const Chromaticity& b);

}  // namespace selenite
