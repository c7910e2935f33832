// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "model/layers.h"
#include "model/micronormals.h"
#include "model/refraction.h"

namespace selenite {

/// How a material refracts: index of refraction beyond over here, and the width of the micronormals,
/// squared; 0 for a smooth surface.
struct RefractionSpread {
  float eta = 0, width2 = 0;
};

/// Empty where nothing is refracted, or passes unbent.
template <class T>
std::optional<RefractionSpread> refraction_spread(const Layers<T>& layers) {
  const float eta = value_of(layers.eta), width2 = value_of(layers.through_width2);
  if (!layers.has(kGlass) || bends_nothing(eta)) return std::nullopt;
  const double singular = layers.version1 ? kSingularWidth2V1 : kSingularWidth2;
  return RefractionSpread{eta, width2 <= static_cast<float>(singular) ? 0 : width2};
}

/// Share of the light that a smooth surface refracts, which it meets at an angle of that cosine.
template <class T>
Color<T> smooth_refraction(const Layers<T>& layers, float cosine) {
  return layers.glass_passing(cosine);
}

}  // namespace selenite
