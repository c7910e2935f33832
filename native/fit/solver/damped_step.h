// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/problem/reparametrization.h"
#include "fit/solver/recursive_least_squares.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "GaussNewtonOptions".
struct DampedStepOptions {
  double least_value = 0.003;   ///< least singular value of the scaled normal matrix
  double least_strength = 0.1;  ///< share of Z^T w Z that scales a component at least
  /// Standard deviation of the log of an extinction between channels, before any photo.
  double unlikeness = 0.5;
};

/// How far a step may go.
struct StepLimits {
  double damping;  ///< Levenberg-Marquardt, in units of the scaled normal matrix
  double longest;  ///< largest component, in units of `Reparametrization::cap`
  bool fix_roughness = false;
};

/// Where a solution of the normal equations leads, by component.
struct DampedStep {
  Vector step;  ///< the step to take
  Vector
      remaining;  ///< distance to convergence: all that is left, and one standard deviation of it
};

/// The step from `u` within bounds and limits. A component that would leave at a bound stays there,
/// and the others are solved again without it.
DampedStep damped_step(const RecursiveLeastSquares& equations, const Unknowns& unknowns,
                       const Reparametrization& reparametrization, const Vector& u,
                       const StepLimits& limits, const DampedStepOptions& options = {});

}  // namespace selenite
