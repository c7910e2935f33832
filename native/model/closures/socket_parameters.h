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

constexpr Parameter film_thickness_parameter() {
  return {.name = "thin_film_thickness",
          .sockets = "Thin Film Thickness",
          .unit = "nm",
          .lower = 0,
          .upper = 100000,
          .fit_lower = 30,
          .fit_upper = 1000,
          .initial = 0,
          .versions = Versions::k2,
          .help = "Thickness of a film whose interference colours reflections"};
}
constexpr Parameter film_ior_parameter() {
  return {.name = "thin_film_ior",
          .sockets = "Thin Film IOR",
          .unit = "1",
          .lower = 0,
          .upper = 1000,
          .fit_lower = 1,
          .fit_upper = 2.5,
          .initial = 1.33,
          .versions = Versions::k2,
          .help = "Index of refraction of the film"};
}

}  // namespace selenite::closures
