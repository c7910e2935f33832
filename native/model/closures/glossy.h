// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Reflection by micronormals of the same reflectance at every angle.
template <class T>
struct Glossy {
  Color<T> color{T(0.8)};
  T roughness{0.5};
  T anisotropy{0};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 0.8, "Reflectance of the micronormals"), m.color);
    visit(roughness_parameter(0.5, "Square root of the micronormals' width"), m.roughness);
    visit(anisotropy_parameter(-1), m.anisotropy);
  }
};

}  // namespace selenite::closures
