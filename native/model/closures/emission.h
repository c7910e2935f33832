// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Emits the same radiance in every direction, from both sides.
template <class T>
struct Emission {
  Color<T> color{T(1)};
  T strength{1};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(Parameter{.name = "color",
                    .sockets = "Color",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0,
                    .fit_upper = 1,
                    .initial = 1,
                    .effect = Effect::kEmission,
                    .help = "Colour of the emitted light"},
          m.color);
    visit(Parameter{.name = "strength",
                    .sockets = "Strength",
                    .unit = "W/(m^2 sr)",
                    .lower = 0,
                    .upper = 1e6,
                    .fit_lower = 0.001,
                    .fit_upper = 10,
                    .initial = 1,
                    .effect = Effect::kEmission,
                    .help = "Radiance of the emitted light where its colour is 1"},
          m.strength);
  }
};

}  // namespace selenite::closures
