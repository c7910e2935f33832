// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace selenite {

struct BoundedInfluenceOptions {
  double most = 0.5;  ///< strength of a cell, in medians of its neighbourhood
  int radius = 2;     ///< of that, in cells
};

/// Of a photo's cells, row by row, factors at most 1 for the weights of their residuals. `strength`: the weighted
/// square of a cell's derivatives, 0 where it has none.
///
/// Derivatives by a number such as a roughness are mostly noise, and a few samples make most of it. Equations
/// take a cell by the square of its derivatives, so that these few would rule. A cell therefore counts
/// by no more than its neighbours do. Source: Krasker and Welsch 1982, JASA 77 (bounded influence).
Eigen::ArrayXf bounded_influence(const Eigen::ArrayXf& strength, int columns,
                                 const BoundedInfluenceOptions& options = {});

}  // namespace selenite
