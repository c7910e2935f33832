// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

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

/// The mean of two independent draws of a picture of derivatives, or of a difference: clipped, filtered
/// by what the two have in common. `share`: variance of the mean's noise over the sum of theirs.
Eigen::VectorXf instrument_of(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                              const Eigen::VectorXf& other, double share, const Capture& capture,
                              int channel, const Eigen::VectorXf& importance);

/// Jacobians of a capture summed over iterations, halves apart: derivative images whose noise falls
/// from iteration to iteration.
class JacobianSums {
 public:
  /// What one half of all samples says. Instruments of half A are for the residuals and the slopes of
  /// half B: they share no sample with these, not by the filter either. Where they do, what chance
  /// made alike passes the filter, and derivatives seem larger than they are.
  struct Half {
    Jacobian instruments;  ///< the slopes clipped and filtered
    Jacobian slopes;       ///< means
    Jacobian noise;        ///< another draw of the noise of `slopes`
  };
  struct Set {
    Half a, b;
  };
  /// Forgets, adds the halves of this iteration, and returns what all say. `importance` of the rows,
  /// as in the sums that they will be part of; `weight`: samples of these halves in units of those
  /// of a usual iteration.
  Set add(const Problem& problem, const Capture& capture, const Halves& halves,
          const Eigen::VectorXf& importance, double keep, double weight = 1);
  void members(SavedState& state);

 private:
  /// Each half is in two parts, whose likeness tells its signal from its noise.
  struct Part {
    Jacobian a, b;
    double weight = 0;
    void members(SavedState& state);
  };
  Half half(const Problem& problem, const Capture& capture, Jacobian Part::*which,
            const Eigen::VectorXf& importance) const;

  std::array<Part, 2> parts_;
  int adds_ = 0;
};

}  // namespace selenite
