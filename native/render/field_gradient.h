// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "render/film.h"
#include "render/render.h"
#include "scene/scene.h"

namespace selenite {

/// How a loss depends on the mean image I of one pixel: its slope d loss / d I, and the curvature
/// that meets the covariance of I with its derivative (see LossResult).
struct PixelSlope {
  Colorf slope, curvature;
};
/// Called once for each pixel when its samples are done, from any thread: may read that pixel of the
/// film and nothing else of it.
using PixelLoss = std::function<PixelSlope(std::size_t pixel, const Film& film)>;

/// A picture, and the derivative of a loss by every value of some fields.
struct FieldGradient {
  Film film;
  std::vector<std::vector<double>> fields;  ///< each as long as its grid's `values`
};

/// Renders, and differentiates a loss with respect to every voxel of the grids in `unknown`, in the
/// same pass: each path leaves a tape, which is swept back when its pixel's residual is known.
/// The cost does not depend on the number of voxels, and the memory of a pass only by one number for
/// each.
///
/// For a squared loss this is the unbiased form over all pairs of different samples of a pixel:
/// sample i weighs slope / n - curvature (I_i - I) / (n (n - 1)). Detached sampling, as `render`.
/// Equal settings give equal bytes whatever the number of threads. No `loss`: the picture alone,
/// from the same samples. Throws Cancelled, InvalidArgument (no such grid, one twice).
FieldGradient render_field_gradient(const Scene& scene, const Camera& camera,
                                    const std::vector<GridRef>& unknown,
                                    const RenderSettings& settings, const PixelLoss& loss,
                                    Progress* progress = nullptr);

}  // namespace selenite
