// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Lets light pass straight through.
template <class T>
struct Transparent {
  Color<T> color{T(1)};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 1, "Colour of what passes straight through"), m.color);
  }
};

}  // namespace selenite::closures
