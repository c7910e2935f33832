// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "fit/inference/normal_solution.h"

namespace selenite {

// Steps and intervals of a low roughness. The slope there is a difference with a picture above it
// (`render_derivatives`), as there is no room below. Down to the bound pictures change by far less than
// that slope says. Source: docs/method/confidence.md, "Low roughness".

/// Extends the interval of component k at `coordinate` as far as nothing can be seen of it; `reach`: what
/// the slope says.
void extend_roughness_interval(const ExpansionPoint& point, Eigen::Index k, double coordinate,
                               double reach, std::array<double, 2>& interval);

/// A step down leads farther than the slope says. A step up stays as it is: noise alone would take a
/// smooth body to a roughness that looks the same.
double roughness_step(const ExpansionPoint& point, Eigen::Index k, double step);

/// Where the steps from both ends of a way lead into it, the end lies in between, divided as the two
/// steps are. Neither knows how far its slope holds, and they would go to and fro.
double bisected_step(const ConfidenceOptions& options, double previous_step, double step);

/// The step with each roughness that is known and inside its bounds at its mean by likelihood; the
/// others follow.
Vector likely_step(const ExpansionPoint& point, const std::vector<Eigen::Index>& free,
                   const NormalSolution& solution);

}  // namespace selenite
