// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "render/field_gradient.h"
#include "render/kernel.h"
#include "render/sparse_gradient.h"

namespace selenite {

/// What the paths of a tile need besides the prepared scene.
struct TapedWork {
  const std::vector<Field>& fields;
  const PixelLoss& loss;  ///< empty: no gradient
};

/// Renders all samples of a tile's pixels and sweeps their tapes; one gradient a field.
TileReport render_taped_tile(const Prepared<kTaped>& prepared, const PixelCamera& camera,
                             const RenderSettings& settings, const Tile& tile,
                             const TapedWork& work, Film& film,
                             std::vector<SparseGradient>& gradients);

}  // namespace selenite
