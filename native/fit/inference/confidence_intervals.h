// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "fit/inference/confidence.h"
#include "fit/inference/normal_equations.h"
#include "fit/problem/reparametrization.h"

namespace selenite {

/// One Gauss-Newton step from the equations, and how sure it is.
struct Estimate {
  Vector step;          ///< in determined directions only, inside the bounds
  double surprise = 0;  ///< largest component of it along a direction, in standard deviations
  std::vector<Confidence> components;
  Eigen::MatrixXd covariance;  ///< see `TrustReport`
};
/// What another pass has found of a component.
struct Known {
  double value;
  Confidence confidence;
};
/// What other passes say, in `Reparametrization`; empty: nothing.
struct OtherPasses {
  Vector previous_step{};  ///< to this pass; a roughness that turns back stays within it
  Vector unsure_step{};    ///< counts as one more standard error
  std::vector<std::optional<Known>> known{};  ///< see offset_expansion.h
  std::vector<bool> squared{};                ///< components that show by their square only
  double beyond_noise = 1;  ///< errors in units of those by noise; steps do not depend on it
  void members(SavedState& state) {
    state(previous_step, unsure_step, known, squared, beyond_noise);
  }
};
Estimate estimate(const Unknowns& unknowns, const Reparametrization& reparametrization,
                  const Vector& u, const NormalEquations& equations, const OtherPasses& others = {},
                  const ConfidenceOptions& options = kConfidence);

/// Widens the intervals to hold x, which is what the user gets. A step may lead beyond the longest one
/// or a bound; the interval around its end may then not reach back.
void contain(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& x,
             std::vector<Confidence>& components, const ConfidenceOptions& options = kConfidence);

}  // namespace selenite
