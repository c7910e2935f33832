// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "render/driver/progress.h"
#include "render/film/render_settings.h"
#include "scene/scene.h"

namespace selenite {

/// The slope of a loss by the share of each pixel that shows an object.
using CoverageLoss = std::function<std::vector<float>(const std::vector<float>& coverage)>;

/// What a camera sees of an object, and the derivative of a loss by its vertices.
struct CoverageGradient {
  std::vector<float> coverage;  ///< of each pixel the share that shows it
  std::vector<Vec3d> vertices;  ///< in the scene's coordinates
  double cpu_seconds = 0;
};

/// Where a camera sees an object, whatever its material and the light; the derivative is that by its
/// outlines, from samples that are independent of those of the coverage. Throws Cancelled.
CoverageGradient render_coverage_gradient(const Scene& scene, const Camera& camera, int instance,
                                          const RenderSettings& settings, const CoverageLoss& loss,
                                          Progress* progress = nullptr);

}  // namespace selenite
