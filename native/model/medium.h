// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "math/dual.h"
#include "model/parameter.h"

namespace selenite {

/// A homogeneous participating medium: what lies behind a surface, on the inside of its geometric
/// normal. All zero is no medium.
template <class T>
struct Medium {
  Color<T> extinction{};  // sigma_t; its share that scatters is `albedo`
  Color<T> albedo{T(0.8)};
  T anisotropy{0};

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    visit(Parameter{.name = "extinction",
                    .sockets = "",
                    .unit = "1/Blender unit",
                    .lower = 0,
                    .upper = 1e8,
                    .fit_lower = 0.001,
                    .fit_upper = 1000,
                    .initial = 0,
                    .scale = Scale::kLog,
                    .effect = Effect::kVolume,
                    .alike = true,
                    .help = "How often light meets the medium inside the object, per length"},
          m.extinction);
    visit(Parameter{.name = "albedo",
                    .sockets = "",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1,
                    .fit_lower = 0.001,
                    .fit_upper = 0.9999,
                    .initial = 0.8,
                    .scale = Scale::kReflectance,
                    .effect = Effect::kVolume,
                    .help = "Share of what meets the medium that is scattered, not absorbed"},
          m.albedo);
    visit(Parameter{.name = "anisotropy",
                    .sockets = "",
                    .unit = "1",
                    .lower = -0.999,
                    .upper = 0.999,
                    .fit_lower = -0.95,
                    .fit_upper = 0.95,
                    .initial = 0,
                    .effect = Effect::kVolume,
                    .help = "Mean cosine of scattering in the medium: above 0 forwards"},
          m.anisotropy);
  }
};

/// Phase function of Henyey and Greenstein 1941, 1/sr; `cosine` of the deflection, 1 straight on.
template <class T, class S>
auto henyey_greenstein(const T& g, const S& cosine) {
  using std::sqrt;
  using X = decltype(g * cosine);
  const X d = T(1) + g * g - g * (2 * cosine);
  return X((T(1) - g * g) / (d * sqrt(d)) * (number_t<T>(0.25) * kInvPi<T>));
}
/// Draws the cosine of the deflection with that density: its distribution function, inverted.
template <class S>
S sample_henyey_greenstein(std::type_identity_t<number_t<S>> g, S u) {
  if (std::abs(g) < number_t<S>(0.05)) {
    // The same without a division by g: nothing jumps at 0, where light is scattered evenly.
    const S x = 2 * u - 1;
    const S sum = x + g * ((3 + x * x) / 2 + g * (x + g * (x * x - 1) / 2));
    return clamp(sum / square(1 + g * x), S(-1), S(1));
  }
  const S k = (1 - g) * (1 + g) / (1 - g + 2 * g * u);
  return clamp((1 + g * g - k * k) / (2 * g), S(-1), S(1));
}

}  // namespace selenite
