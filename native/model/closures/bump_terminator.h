// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "model/micronormals.h"

namespace selenite {

/// Share of a diffuse lobe about the normal n that is left towards w on a surface of the normal s,
/// unit vectors: where a bumped normal faces a direction that the surface turns away from, light would
/// end abruptly. Source: Estevez, Lecocq, Stein 2019, "A Microfacet-Based Shadowing Function to Solve
/// the Bump Terminator Problem".
template <class S>
S bump_terminator(const Vec3<S>& s, const Vec3<S>& n, const Vec3<S>& w) {
  const S cos_sn = dot(s, n), cos_sw = dot(s, w);
  if (cos_sw * cos_sn * dot(n, w) < S(0)) return S(0);
  const S tan2 = (1 - cos_sn * cos_sn) / max(cos_sn * cos_sn, S(1e-14));
  const S width2 = min(max(tan2, S(0)) / 8, S(1));
  const S tan2_w = max(1 - cos_sw * cos_sw, S(0)) / max(cos_sw * cos_sw, S(1e-14));
  return 1 / (1 + ggx_lambda(tan2_w, width2));
}

}  // namespace selenite
