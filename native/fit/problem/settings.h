// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "fit/problem/render_workers.h"
#include "render/driver/render.h"
#include "render/film/setting_range.h"

namespace selenite {

using Renderer = std::function<Film(const Scene&, const Camera&, const SlotLayout&,
                                    const RenderSettings&, Progress*)>;

/// How a fit runs. The table of names and ranges that Python sees is in fit_binding.cpp.
struct FitSettings {
  std::string loss = "robust";
  std::string optimiser = "auto";
  int iterations = 100;
  /// Up to where a descent of scalars alone goes on that has not converged by then; 0: no farther.
  int most_iterations = 0;
  int spp = 4;  ///< samples per pixel of a step
  double tolerance =
      0.001;  ///< stop when the mean of the last 3 validation losses is below; 0: never
  std::uint64_t seed = 0;
  int depth = 0;           ///< bounces; 0 = no limit
  int threads = 0;         ///< 0 = one per core
  bool accumulate = true;  ///< one step for all photos; false: one after each photo
  /// Iterations between validation renders. Of fields after a multi-start these are where blocks begin.
  int validation_interval = 5;
  int validation_spp = 0;  ///< 0: twice spp, at least 16
  /// Finite differences in place of some derivatives: `render_derivatives` says which.
  bool finite_differences = true;
  /// Whether a multi-start precedes the first step: "on", "off", or "auto" (with Gauss-Newton, where there
  /// are no grids and images, or `UniformFields`).
  std::string search = "auto";
  /// Whether refinement passes with fresh seeds at fixed values follow, for intervals: the same three.
  std::string refinement = "auto";
  int refinement_spp = 0;  ///< of a pass; 0: as many as the iterations took, at least 64
  /// Half of a 90 % interval that suffices, as a share of the bounds' distance, or twice that of the
  /// value; 0: a refinement takes all its samples.
  double precision = 0;
  /// How far the prior of fields counts beside the photos: by "agreement", what is left of the residuals beside
  /// a pattern on which the photos agree, or by the whole "misfit".
  std::string prior = "agreement";
  Renderer renderer = render;  ///< a test puts an analytic picture here
  /// Who renders in its place; null: nobody. Results are the same bit by bit.
  std::shared_ptr<RenderWorkers> workers{};

  int chosen_most_iterations() const { return std::max(iterations, most_iterations); }
  int chosen_validation_spp() const;
  int chosen_refinement_spp() const;
  bool by_agreement() const { return prior == "agreement"; }
  /// InvalidArgument names every setting that is out of range.
  void check() const;
};

/// Of a fit. Depth and threads are a render's.
std::span<const SettingRange> fit_ranges();

}  // namespace selenite
