// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/principled.h"

namespace selenite::closures {

/// The Principled BSDF as a closure of a mixture, where metal and the specular lobe may have two widths.
template <class T>
struct AnisotropicPrincipled : selenite::Principled<T> {
  using Isotropic = selenite::Principled<T>;

  T anisotropic{0};

  AnisotropicPrincipled() = default;
  /// Implicit: what has no anisotropy is a closure as it is.
  AnisotropicPrincipled(const Isotropic& m) : Isotropic(m) {}

  template <class Self, class Visit>
  static constexpr void fields(Self& m, Visit&& visit) {
    Isotropic::fields(m, visit);
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
  }
};

}  // namespace selenite::closures
