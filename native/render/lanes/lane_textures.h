// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "math/lanes.h"
#include "model/bsdf.h"
#include "render/prepared/mapped_color.h"
#include "render/prepared/prepared_material.h"

namespace selenite {

/// Whether images and vertex colours of a material only colour its diffuse lobe. The eight points of a
/// bsdf share all else.
template <int L>
bool colours_diffuse_alone(const PreparedMaterial<L>& m) {
  const auto acts = [](const auto& x) { return value_of(x) != 0 || has_slope(x); };
  const auto& v = m.values;
  if (m.flavour.version != Flavour::Version::kV2 || !m.unknown_maps.empty()) return false;
  if (acts(v.metallic) || acts(v.transmission) || acts(v.diffuse_roughness)) return false;
  return std::all_of(m.maps->begin(), m.maps->end(), [](const FieldMap& map) {
    return map.field == material_field(&MaterialValues::base_color);
  });
}

/// The layers of a white material whose diffuse lobe has a colour in each lane.
template <class X>
struct ColouredLayers : Layers<X> {
  using Source = Principled<uniform_t<X>>;

  ColouredLayers(const Source& white, const Flavour& flavour, const SurfacePoint<Lanes>& point,
                 const Lanes& cos_i, const LaneMask& active, const Color<Lanes>& color)
      : Layers<X>(white, flavour, point, cos_i, active) {
    for (int c = 0; c < 3; ++c) this->diffuse[c] = this->diffuse[c] * color[c];
    this->estimate_[kDiffuse] = this->estimate_[kDiffuse] * mean_channel(color);
    this->choose();
  }
};

}  // namespace selenite
