// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Reflection by fibres that stand on the surface (Microfiber); see the lobe Sheen.
template <class T>
struct Sheen {
  Color<T> color{T(0.8)};
  T roughness{0.5};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 0.8, "Colour of the fibres' reflection"), m.color);
    Parameter p = roughness_parameter(0.5, "How far the reflection reaches from the rim inwards");
    p.scale = Scale::kLinear;
    p.fit_lower = 0.1;
    visit(p, m.roughness);
  }
};

}  // namespace selenite::closures
