// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "scene/shader/functions.h"

namespace selenite::shading {

/// Coefficients of one piece: channel = a / T + b T + c for red and green, a cubic for blue.
struct BlackbodyPiece {
  double below;  ///< kelvin
  std::array<double, 3> red, green;
  std::array<double, 4> blue;
};
const BlackbodyPiece& blackbody_piece(double kelvin);
inline constexpr double kColdest = 800, kHottest = 12000;  ///< constant beyond

/// A colour of luminance about 1, as Cycles approximates it.
template <class T>
Color<T> blackbody(const T& kelvin) {
  using S = scalar_t<T>;
  // Beyond, a colour that the pieces only nearly reach.
  if (value_of(kelvin) < S(kColdest)) return lifted<T>(Colorf{5.41329432f, 0, 0});
  if (!(value_of(kelvin) < S(kHottest)))
    return lifted<T>(Colorf{0.8262955f, 0.99450803f, 1.56630766f});
  const T& t = kelvin;
  const BlackbodyPiece& piece = blackbody_piece(static_cast<double>(value_of(t)));
  const auto rational = [&](const std::array<double, 3>& k) {
    return S(k[0]) / t + t * S(k[1]) + S(k[2]);
  };
  const auto& k = piece.blue;
  const T blue = ((t * S(k[0]) + S(k[1])) * t + S(k[2])) * t + S(k[3]);
  return map(Color<T>{rational(piece.red), rational(piece.green), blue},
             [](const T& x) { return max(x, T(0)); });
}

}  // namespace selenite::shading
