// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// GGX reflection of the same reflectance at every angle.
template <class T>
struct Glossy {
  Color<T> color{T(0.8)};
  T roughness{0.5};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 0.8, "Reflectance of the micronormals"), m.color);
    visit(roughness_parameter(0.5, "Square root of the GGX width"), m.roughness);
  }
};

}  // namespace selenite::closures
