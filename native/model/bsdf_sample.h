// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "math/color.h"
#include "math/vec.h"
#include "model/ray_kind.h"

namespace selenite {

/// A drawn direction.
template <class T>
struct BsdfSample {
  using Mask = mask_t<T>;

  Vec3<scalar_t<T>> wo;  ///< world frame, unit, away from the surface
  scalar_t<T> density;   ///< of the whole mixture, 1/sr; a probability if singular
  Color<T> weight;       ///< value / density; derivatives are those of the value alone
  Mask singular;
  Mask transmits;        ///< wo lies behind the geometric surface
  Mask diffuse = false;  ///< drawn from a diffuse lobe
  /// The light goes on under the surface, by a random walk that starts towards wo; the weight is that
  /// of the lobe without its colour.
  Mask enters = false;
  Mask exists = true;  ///< the light is not absorbed; else nothing else here counts

  RayKind kind() const requires(!kIsLanes<T>) {
    return transmits ? kTransmissionRay : diffuse ? kDiffuseRay : kGlossyRay;
  }
};

}  // namespace selenite
