// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Diffuse reflection: Lambert's at roughness 0, else Oren and Nayar's with several bounces.
template <class T>
struct Diffuse {
  Color<T> color{T(0.8)};
  T roughness{0};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 0.8, "Colour of diffuse reflection"), m.color);
    visit(Parameter{.name = "roughness",
                    .sockets = "Roughness",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 0,
                    .help = "Roughness of the diffuse reflection; 0 is Lambertian"},
          m.roughness);
  }
};

}  // namespace selenite::closures
