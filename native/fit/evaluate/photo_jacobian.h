// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fit/problem/reparametrization.h"
#include "fit/evaluate/half_buffers.h"
#include "render/driver/render.h"

namespace selenite {

/// What one camera shows of the unknowns at their start values; no photo takes part.
struct PhotoJacobian {
  Film film;
  /// d picture / d `Reparametrization` over the even and over the odd samples: independent of each other,
  /// so products of one with the other have no bias of noise.
  Jacobian a, b;
};

/// Takes differences in place of derivatives where a fit does (`render_derivatives`): one render more
/// for each. Throws Cancelled, InvalidArgument (fewer than two samples; what `render` refuses),
/// UnknownName.
PhotoJacobian photo_jacobian(const Scene& scene, const Unknowns& unknowns, const std::string& camera,
          const RenderSettings& settings, Progress* progress = nullptr);

}  // namespace selenite
