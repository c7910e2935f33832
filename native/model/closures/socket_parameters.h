// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

#include "model/parameter.h"

namespace selenite::closures {

// Parameters that several closures have.

constexpr Parameter color_parameter(std::string_view sockets, double initial,
                                    std::string_view help) {
  return {.name = "color",
          .sockets = sockets,
          .unit = "1",
          .lower = 0,
          .upper = 1,
          .fit_lower = 0,
          .fit_upper = 1,
          .initial = initial,
          .help = help};
}

/// Of micronormals.
constexpr Parameter roughness_parameter(double initial, std::string_view help) {
  return {.name = "roughness",
          .sockets = "Roughness",
          .unit = "1",
          .lower = 0,
          .upper = 1,
          .fit_lower = 0.02,
          .fit_upper = 1,
          .initial = initial,
          .scale = Scale::kRoughness,
          .help = help};
}

constexpr Parameter ior_parameter(double initial, std::string_view help) {
  return {.name = "ior",
          .sockets = "IOR",
          .unit = "1",
          .lower = 1e-5,
          .upper = 10,
          .fit_lower = 1,
          .fit_upper = 2.5,
          .initial = initial,
          .scale = Scale::kLogExcess,
          .help = help};
}

/// Of a reflection of two widths.
constexpr Parameter anisotropy_parameter(double lower) {
  return {.name = "anisotropy",
          .sockets = "Anisotropy",
          .unit = "1",
          .lower = lower,
          .upper = 1,
          .fit_lower = 0.9 * lower,
          .fit_upper = 0.9,
          .initial = 0,
          .help =
              "How much longer highlights are along the tangent than across, or the other way "
              "round below 0"};
}

}  // namespace selenite::closures
