// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/inference/normal_solution.h"

namespace selenite {

// Values that show by their square only: others make up for the rest of their effect, so that their
// slope vanishes at 0. Source: docs/method/confidence.md, "Offset expansion".

/// Whether that is so of component k, the `at`-th free one, by the normal equations.
bool shows_by_square(const ExpansionPoint& point, const NormalEquations& equations,
                     const NormalSolution& solution, Eigen::Index at, Eigen::Index k);

/// Bends its step, which is by the slope at x; the others make up for it.
void bend_step(const ExpansionPoint& point, double x, Eigen::Index at, Eigen::Index k,
               NormalSolution& solution);

/// Sets its interval and error around x. `far`: the step may lead to where what remains of the value
/// itself is of the size of its square. The interval then spans both ends.
void set_square_interval(const ExpansionPoint& point, Eigen::Index k, double x, double step,
                         double error, bool far, Confidence& confidence);

}  // namespace selenite
