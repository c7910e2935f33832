// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/vec.h"

namespace selenite {

/// Where a ray meets a surface; world frame, unit vectors. The flags are the same for all lanes.
template <class S>
struct SurfacePoint {
  Vec3<S> ng;       ///< geometric normal on the viewer's side: dot(ng, wi) > 0
  Vec3<S> n;        ///< shading normal, flipped whenever ng was
  Vec3<S> wi;       ///< towards the viewer
  bool backfacing;  ///< the geometric face is seen from behind: glass is left, not entered
  /// The path has been scattered diffusely before: subsurface scattering is rendered as diffuse
  /// reflection, as in Cycles.
  bool after_diffuse = false;
  Vec3<S> tangent{};  ///< of micronormals of two widths: the x axis lies in its plane; 0: none
  Vec3<S> smooth{};   ///< the interpolated normal where n is another, as of a bump; 0: n

  const Vec3<S>& interpolated() const {
    if constexpr (!kIsLanes<S>)
      if (dot(smooth, smooth) > S(0)) return smooth;
    return n;
  }
};

/// The frame of the bent normal n.
template <class S>
Frame<S> lobe_frame(const SurfacePoint<S>& p, const Vec3<S>& n) {
  if constexpr (!kIsLanes<S>) {
    const Vec3<S> across = cross(n, p.tangent);
    if (dot(across, across) > S(0)) {
      const Vec3<S> y = normalize(across);
      return {cross(y, n), y, n};
    }
  }
  return Frame<S>::from_normal(n);
}

/// The shading normal, tilted towards the geometric one until the mirror image of the viewer stands
/// at least min(0.9 cos, 0.01) above the geometric surface, cos = dot(ng, wi). As in Cycles 4.5, a
/// normal that points away from the viewer stays where its opposite would.
///
/// In the plane of both normals let the new normal make the angle a with ng, and let wi have the
/// components (x, z) there. The mirror direction's height is x sin 2a + z cos 2a = r cos(2a - b) with
/// r = |(x, z)|, b = atan2(x, z); it equals the wanted height t first at 2a = b + acos(t / r).
template <class S>
Vec3<S> visible_normal(const SurfacePoint<S>& p) {
  using Mask = mask_t<S>;
  const S cos_g = dot(p.ng, p.wi), cos_n = dot(p.n, p.wi), cos_gn = dot(p.n, p.ng);
  const S wanted = min(S(0.9) * cos_g, S(0.01));
  const Mask visible = 2 * cos_n * cos_gn - cos_g >= wanted;
  if (all(visible)) return p.n;
  const Vec3<S> side = p.n - p.ng * cos_gn;
  const S side_length = length(side);
  Mask flat = !(side_length > S(1e-6));  // the normals are parallel: no plane, nothing to tilt
  if (all(visible | flat)) return select(visible, p.n, p.ng);
  const Vec3<S> axis = side / side_length;
  const S x = dot(axis, p.wi), r2 = x * x + cos_g * cos_g;
  flat |= !(r2 > wanted * wanted);
  if (all(visible | flat)) return select(visible, p.n, p.ng);
  const S rise = safe_sqrt(r2 - wanted * wanted);
  const S cos_2a = (cos_g * wanted - x * rise) / r2, sin_2a = (x * wanted + cos_g * rise) / r2;
  const S cos_a = safe_sqrt((1 + cos_2a) / 2);
  flat |= !(cos_a > S(1e-3));
  if (all(visible | flat)) return select(visible, p.n, p.ng);
  const Vec3<S> tilted = normalize(p.ng * cos_a + axis * (sin_2a / (2 * cos_a)));
  return select(visible, p.n, select(flat, p.ng, tilted));
}

}  // namespace selenite
