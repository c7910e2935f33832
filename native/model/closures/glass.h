// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"
#include "model/thin_film.h"

namespace selenite::closures {

/// Reflection and refraction by micronormals at a dielectric interface; the colour multiplies both.
template <class T>
struct Glass {
  Color<T> color{T(1)};
  T roughness{0};
  T ior{1.5};
  ThinFilm<T> film{};  ///< of Blender 5

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(color_parameter("Color", 1, "Colour of what is reflected and of what is refracted"),
          m.color);
    visit(roughness_parameter(0, "Square root of the micronormals' width"), m.roughness);
    visit(ior_parameter(1.5, "Index of refraction of the inside over the outside"), m.ior);
    visit(film_thickness_parameter(), m.film.thickness);
    visit(film_ior_parameter(), m.film.ior);
  }
};

}  // namespace selenite::closures
