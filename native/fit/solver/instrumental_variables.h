// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fit/solver/optimiser.h"

namespace selenite {

/// Rows: channels of pixels, as they lie in a Picture; columns: unknowns.
using Jacobian = Eigen::MatrixXf;

/// Independent halves of a film, in an optimiser's reparametrization.
struct Halves {
  Eigen::VectorXf residual_a, residual_b;  ///< half-buffer minus photo
  Eigen::VectorXf variance;                ///< of one half-buffer
  Jacobian jacobian_a, jacobian_b;
  /// By unknown: whether the film has a derivative by it, its columns being 0 otherwise.
  Eigen::ArrayX<bool> differentiated;
};

/// Without the Jacobians.
Halves residual_halves(const Film& film, const Photo& photo);
/// `slope` is dx/du per unknown.
Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope);

/// The mean of two independent draws of a picture of derivatives, or of a difference: clipped, filtered
/// by what the two have in common. `share`: variance of the mean's noise over the sum of theirs.
Eigen::VectorXf filtered_derivative(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                              const Eigen::VectorXf& other, double share, const Photo& photo,
                              int channel, const Eigen::VectorXf& importance);

/// Jacobians of a photo summed over iterations, halves apart: derivative images whose noise falls
/// from iteration to iteration.
class InstrumentalVariables {
 public:
  /// What one half of all samples says. Instruments of half A are for the residuals and the slopes of
  /// half B: they share no sample with these, not by the filter either. Where they do, what chance
  /// made alike passes the filter, and derivatives seem larger than they are.
  struct Half {
    Jacobian filtered;  ///< the slopes clipped and filtered
    Jacobian slopes;       ///< means
    Jacobian noise;        ///< another draw of the noise of `slopes`
  };
  struct Set {
    Half a, b;
  };
  /// Forgets, and adds the halves of this iteration. Columns that these do not have keep what is known
  /// of them. `weight`: samples of these halves in units of those of a usual iteration.
  void add(const Halves& halves, double keep, double weight = 1);
  bool empty() const { return adds_.empty(); }
  /// What all say, unless empty. `importance` of the rows, as in the sums that they will be part of.
  Set all(const SlotLayout& layout, const Photo& photo, const Eigen::VectorXf& importance) const;
  /// The same with the means themselves for instruments: of so many samples that no filter is needed.
  Set plain() const;
  void members(SavedState& state);

 private:
  /// Each half is in two parts, whose tiled_loss tells its signal from its noise.
  struct Part {
    Jacobian a, b;
    Eigen::VectorXd weight;  ///< of the columns
    void members(SavedState& state);
  };
  Half means(Jacobian Part::*which) const;
  /// Variance of the mean of column k over that of the difference of the parts.
  double share(Eigen::Index k) const;
  Half half(const SlotLayout& layout, const Photo& photo, Jacobian Part::*which,
            const Eigen::VectorXf& importance) const;

  std::array<Part, 2> parts_;
  std::vector<int> adds_;  ///< to the columns
};

}  // namespace selenite
