// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"
#include "model/thin_film.h"

namespace selenite::closures {

/// Reflection by micronormals by metal of a complex index of refraction.
template <class T>
struct Conductor {
  Color<T> ior{T(2.5)};         // the node starts at 2.757, 2.513, 2.231
  Color<T> extinction{T(3.4)};  // the node starts at 3.867, 3.404, 3.009
  T roughness{0.5};
  T anisotropy{0};
  ThinFilm<T> film{};  ///< of Blender 5

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    const auto index = [](std::string_view name, std::string_view sockets, double initial,
                          std::string_view help) {
      return Parameter{.name = name,
                       .sockets = sockets,
                       .unit = "1",
                       .lower = 0,
                       .upper = 100,
                       .fit_lower = 0.05,
                       .fit_upper = 10,
                       .initial = initial,
                       .help = help};
    };
    visit(index("ior", "IOR", 2.5, "Real part of the index of refraction"), m.ior);
    visit(index("extinction", "Extinction", 3.4, "Imaginary part of the index of refraction"),
          m.extinction);
    visit(roughness_parameter(0.5, "Square root of the micronormals' width"), m.roughness);
    visit(anisotropy_parameter(0), m.anisotropy);
    visit(film_thickness_parameter(), m.film.thickness);
    visit(film_ior_parameter(), m.film.ior);
  }
};

}  // namespace selenite::closures
