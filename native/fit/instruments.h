// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/optimiser.h"

namespace selenite {

/// Rows: channels of pixels, as they lie in a Picture; columns: unknowns.
using Jacobian = Eigen::MatrixXf;

/// Independent halves of a film, in an optimiser's coordinates.
struct Halves {
  Eigen::VectorXf residual_a, residual_b;  ///< half-buffer minus photo
  Eigen::VectorXf variance;                ///< of one half-buffer
  Jacobian jacobian_a, jacobian_b;
};

/// Without the Jacobians.
Halves residual_halves(const Film& film, const Capture& capture);
/// `slope` is dx/du per unknown.
Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope);

/// Jacobians of a capture summed over iterations, halves apart: derivative images whose noise falls
/// from iteration to iteration and is independent of a fresh residual.
class JacobianSums {
 public:
  /// Instruments for one iteration. No column shares a seed with what it will be multiplied with.
  struct Set {
    Jacobian for_a, for_b;      ///< for the residual of half A, B: all other buffers
    Jacobian only_a, only_b;    ///< clipped and filtered sums of the A, B buffers
    Jacobian plain_a, plain_b;  ///< the same as they are
  };
  /// Forgets, adds the halves of this iteration, and returns the instruments for it. `importance`
  /// of the rows, as in the sums that they will be part of; `weight`: samples of these halves in
  /// units of those of a usual iteration.
  Set add(const Problem& problem, const Capture& capture, const Halves& halves,
          const Eigen::VectorXf& importance, double keep, double weight = 1);
  void members(SavedState& state);

 private:
  Jacobian sum_a_, sum_b_;
  double weight_ = 0;
};

}  // namespace selenite
