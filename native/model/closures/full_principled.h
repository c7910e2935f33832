// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/closures/socket_parameters.h"
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
    visit(film_thickness_parameter(), m.film.thickness);
    visit(film_ior_parameter(), m.film.ior);
  }
};

}  // namespace selenite::closures
