// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/inference/expansion_point.h"
#include "fit/inference/normal_equations.h"

namespace selenite {

/// A component that is not solved for: its step, and the standard deviation of where it leads.
struct FixedComponent {
  Eigen::Index k;
  double step, extent;
};

/// The step of the free components along directions that are resolved, with its covariance.
struct NormalSolution {
  Vector step;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd inverse;  ///< of the normal matrix
  Eigen::MatrixXd
      responses;        ///< of the free components to the extent of each fixed one, a column each
  double surprise = 0;  ///< largest component of the step along a direction, in deviations
  Vector lasting;       ///< shares of the variances by which photos and blocks of pixels differ
};

/// Solves for the components `free` in the singular directions of the scaled normal matrix. A direction
/// whose value is noise does not move, and is as wide as the bounds leave it. Free components make up
/// for the steps and extents of the fixed ones where the two are coupled by more than noise.
/// `unsure_step`: counts as one more standard error; may be empty.
NormalSolution solve(const NormalEquations& equations, const ExpansionPoint& point,
                     const std::vector<Eigen::Index>& free,
                     const std::vector<FixedComponent>& fixed, const Vector& unsure_step);

/// The component whose error is most correlated with that of the `at`-th free one; -1: none is enough.
int strongest_partner(const NormalSolution& solution, Eigen::Index at,
                      const std::vector<Eigen::Index>& free,
                      const std::vector<FixedComponent>& fixed, double least_correlation);

}  // namespace selenite
