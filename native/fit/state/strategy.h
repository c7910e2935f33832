// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "fit/problem/fit_problem.h"
#include "fit/solver/optimiser.h"
#include "fit/state/block_schedule.h"

namespace selenite {

/// Which phases a fit has and what each of them moves: chosen once, from problem and settings.
struct Strategy {
  /// Sets the weights of the problem, and the iterations of its scalars. InvalidArgument where settings contradict each other.
  explicit Strategy(FitProblem& problem);

  const OptimiserKind& optimiser;  ///< of what is no vertex
  bool moves_vertices;             ///< nothing else is fitted then: see `ShapeDescent`
  /// As results name what was used.
  std::string_view method() const { return moves_vertices ? "large-steps" : optimiser.name; }
  /// Scalars and fields are moved in blocks: what Gauss-Newton accumulates would be about fields that
  /// have moved since.
  bool alternates;
  bool multi_start;
  /// What a multi-start varies where fields are fitted; null: the scalars.
  std::unique_ptr<UniformFields> uniform;
  bool joint;    ///< voxels or texels are stepped together with the scalars, see `JointGaussNewton`
  bool refines;  ///< a refinement follows the descent

  bool has_images;       ///< among the fields
  bool has_environment;  ///< likewise: the world's image
  bool after_multi_start() const { return multi_start && uniform; }
  /// A line search finds the IOR of what refracts sharply before each block of scalars, in place of steps by
  /// derivatives: of images after a multi-start that are stepped apart from scalars.
  bool searches_ior() const { return after_multi_start() && has_images && !joint; }
  /// Errors of texels and voxels look like roughness; those of the light look like either. Texels that are
  /// stepped together with scalars leave them free.
  bool prefers_low_roughness() const {
    return after_multi_start() && !has_environment && !(joint && has_images);
  }
  /// The photos are asked how rough a body may be whose light is unknown: see `RoughnessProfile`.
  bool profiles_roughness() const { return joint && has_environment; }
  /// The descent's estimate is one of all iterations, not of the last one.
  bool estimates_by_all_iterations() const {
    return optimiser.averages_iterations && (!alternates || joint);
  }
  /// Samples of an iteration of the descent, in units of `FitSettings::spp`.
  int samples(const FitProblem& problem, int iteration) const;
  /// Iterations of the descent at most.
  int most_iterations(const FitProblem& problem) const;
  /// Blocks of the descent. Where voxels of a grid are stepped together with scalars it takes half of the
  /// iterations, and texels take a quarter: refinement passes at fixed values bring more.
  BlockSchedule blocks(const FitProblem& problem) const;
};

}  // namespace selenite
