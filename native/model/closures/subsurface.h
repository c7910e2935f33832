// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "model/closures/socket_parameters.h"

namespace selenite::closures {

/// Random walk under the surface; see SubsurfaceMedium.
template <class T>
struct Subsurface {
  Color<T> color{T(0.8)};
  T scale{0.05};
  Color<T> radius{T(1)};  // the node starts at 1, 0.2, 0.1: skin
  T ior{1.4};
  T roughness{1};
  T anisotropy{0};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    const auto reach = [](std::string_view name, std::string_view sockets, std::string_view unit,
                          double initial, std::string_view help) {
      return Parameter{.name = name,
                       .sockets = sockets,
                       .unit = unit,
                       .lower = 0,
                       .upper = 1e6,
                       .fit_lower = 0.0001,
                       .fit_upper = 10,
                       .initial = initial,
                       .scale = Scale::kLog,
                       .help = help};
    };
    visit(color_parameter("Color", 0.8, "Colour of what comes out again"), m.color);
    visit(reach("scale", "Scale", "Blender unit", 0.05, "Scales the radius"), m.scale);
    visit(reach("radius", "Radius", "scale", 1, "How far each colour scatters, times the scale"),
          m.radius);
    visit(ior_parameter(1.4, "Index of refraction on entry"), m.ior);
    visit(roughness_parameter(1, "GGX width of the refraction on entry"), m.roughness);
    visit(Parameter{.name = "anisotropy",
                    .sockets = "Anisotropy",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0,
                    .fit_upper = 0.9,
                    .initial = 0,
                    .help = "Forward scattering under the surface"},
          m.anisotropy);
  }
};

}  // namespace selenite::closures
