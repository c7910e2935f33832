// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "fit/evaluate/half_buffers.h"
#include "fit/evaluate/wiener_filter.h"

#include "fit/problem/saved_state.h"

namespace selenite {

class SavedState;

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
    void members(SavedState& state) { state(filtered, slopes, noise); }
  };
  struct Set {
    Half a, b;
    void members(SavedState& state) { state(a, b); }
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
