// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/principled.h"
#include "model/thin_film.h"

namespace selenite::closures {

/// The Principled BSDF as a closure of a mixture: metal and the specular lobe may have two widths, and
/// a thin film may lie on glass and under the coat.
template <class T>
struct FullPrincipled : selenite::Principled<T> {
  using Alone = selenite::Principled<T>;

  T anisotropic{0};
  ThinFilm<T> film{};

  FullPrincipled() = default;
  /// Implicit: what has neither is a closure as it is.
  FullPrincipled(const Alone& m) : Alone(m) {}

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    Alone::fields(m, visit);
    visit(
        Parameter{.name = "anisotropic",
                  .sockets = "Anisotropic",
                  .unit = "1",
                  .lower = 0,
                  .upper = 1,
                  .fit_lower = 0,
                  .fit_upper = 1,
                  .initial = 0,
                  .versions = Versions::k2,
                  .help = "How much longer highlights of metal and of the specular lobe are along "
                          "the tangent than across"},
        m.anisotropic);
    visit(Parameter{.name = "thin_film_thickness",
                    .sockets = "Thin Film Thickness",
                    .unit = "nm",
                    .lower = 0,
                    .upper = 100000,
                    .fit_lower = 30,
                    .fit_upper = 1000,
                    .initial = 0,
                    .versions = Versions::k2,
                    .help = "Thickness of a film whose interference colours reflections"},
          m.film.thickness);
    visit(Parameter{.name = "thin_film_ior",
                    .sockets = "Thin Film IOR",
                    .unit = "1",
                    .lower = 0,
                    .upper = 1000,
                    .fit_lower = 1,
                    .fit_upper = 2.5,
                    .initial = 1.33,
                    .versions = Versions::k2,
                    .help = "Index of refraction of the film"},
          m.film.ior);
  }
};

}  // namespace selenite::closures
