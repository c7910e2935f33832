// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Lambertian transmission: light that comes out diffusely on the other side.
template <class T>
struct Translucent {
  Color<T> color{T(0.8)};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 0.8, "Colour of diffuse transmission"), m.color);
  }
};

}  // namespace selenite::closures
