// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "fit/objective/half_buffers.h"
#include "fit/problem/reparametrization.h"
#include "render/driver/render.h"

namespace selenite {

/// Derivatives are rendered in so many portions, with differences from above and from below in
/// turns: each of the two parts that `InstrumentalVariables` keep is to hold both sides.
inline constexpr int kJacobianPortions = 4;
/// A portion has two halves of one sample at least.
inline constexpr int kLeastJacobianSpp = 2 * kJacobianPortions;

/// What one photo shows of the unknowns at their start values; its pixels take no part.
struct PhotoJacobian {
  int width = 0, height = 0;
  SlotLayout layout;
  Picture mean;              ///< over all samples
  Eigen::VectorXf variance;  ///< of one sample, 3 numbers a pixel
  /// With d picture / d `Reparametrization` over the even and over the odd samples: independent of
  /// each other, so that products of one with the other have no bias of noise.
  struct Portion {
    Halves halves;  ///< the residuals are the picture itself
    int spp;
  };
  std::vector<Portion> portions;
  std::int64_t dropped = 0;
  std::vector<std::string> not_finite;  ///< components ("Body:ior") whose derivatives are not

  int spp() const;
  /// Adds the samples of another one of the same photo, unknowns and size, with another seed.
  /// InvalidArgument where it is of others.
  void join(const PhotoJacobian& other);
};

/// Renders and takes differences as a refinement pass does: derivatives in four portions of
/// `settings.spp` samples together. Size and frame are those of the settings. Throws Cancelled, InvalidArgument (fewer than
/// `kLeastJacobianSpp`; what `render` refuses), UnknownName.
PhotoJacobian photo_jacobian(const Scene& scene, const Unknowns& unknowns, const Photo& photo,
                             const RenderSettings& settings, Progress* progress = nullptr);

}  // namespace selenite
