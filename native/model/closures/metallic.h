// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"
#include "model/thin_film.h"

namespace selenite::closures {

/// Reflection by micronormals by metal of a colour at normal incidence and one near the edge.
template <class T>
struct Metallic {
  Color<T> base_color{T(0.6)};  // the node starts at 0.617, 0.577, 0.540
  Color<T> edge_tint{T(0.7)};   // the node starts at 0.695, 0.726, 0.770
  T roughness{0.5};
  T anisotropy{0};
  ThinFilm<T> film{};  ///< of Blender 5

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    Parameter p = color_parameter("Base Color", 0.6, "Reflectance at normal incidence");
    p.name = "base_color";
    visit(p, m.base_color);
    p = color_parameter("Edge Tint", 0.7, "Factor of the reflectance at 82 degrees");
    p.name = "edge_tint";
    visit(p, m.edge_tint);
    visit(roughness_parameter(0.5, "Square root of the micronormals' width"), m.roughness);
    visit(anisotropy_parameter(0), m.anisotropy);
    visit(film_thickness_parameter(), m.film.thickness);
    visit(film_ior_parameter(), m.film.ior);
  }
};

}  // namespace selenite::closures
