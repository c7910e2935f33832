// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/problem/saved_state.h"
#include "fit/problem/significance.h"
#include "fit/problem/unknowns.h"

namespace selenite {

/// Changes of several values, and of the gains that follow them, that hardly show in the photos: what
/// makes up for what.
struct WeakDirection {
  double deviation = 0;         ///< standard deviation along it, in ranges of the components
  std::vector<int> components;  ///< that take part, the strongest first
  std::vector<int> photos;      ///< whose gains follow it
  void members(SavedState& state) { state(deviation, components, photos); }
};

/// Sources: docs/measurements/constants.md, "WeakDirectionOptions".
struct WeakDirectionOptions {
  double undetermined =
      kNarrowShare;   ///< standard deviation, in ranges, from which a direction is weak
  double part = 0.3;  ///< of the largest change, from which a component takes part
  double gain = 0.1;  ///< change of log gain from which a gain takes part
};

/// Directions of the scaled normal matrix that are next to null: those of the covariance, each component
/// in its `ranges`, that are wide. `gain_slopes` as of `GainSlopes`. One that no other component and no
/// gain takes part in is left out: it is just not seen.
std::vector<WeakDirection> weak_directions(const Eigen::MatrixXd& covariance, const Vector& ranges,
                                           const std::vector<Eigen::MatrixXd>& gain_slopes,
                                           const WeakDirectionOptions& options = {});

}  // namespace selenite
