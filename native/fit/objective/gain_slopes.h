// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/objective/half_buffers.h"

namespace selenite {

class SavedState;

/// By how much the free gain of each photo follows the values: d log gain / d unknown, in
/// `Reparametrization`.
///
/// The gain is eliminated from the normal equations. This row is what it takes to give it back its share
/// of the joint covariance: that of the values, through these slopes, beside its own error at given
/// values. Source: docs/method/losses.md, "Free gain of a photo".
class GainSlopes {
 public:
  GainSlopes() = default;
  explicit GainSlopes(const Problem& problem);

  /// Adds derivatives of one photo, before any gain is eliminated. `slope` is dx/du per unknown;
  /// `weight`: their samples in units of those of an iteration. Photos without a free gain stay empty.
  void add(const Problem& problem, const Observation& derivatives, const Vector& slope,
           double weight);
  /// Of each photo 3 rows, its channels, and a column per unknown; no rows where no gain is free or
  /// nothing has been added.
  std::vector<Eigen::MatrixXd> slopes() const;
  /// What the width of the priors adds to the covariance of the score: no residual shows it.
  Eigen::MatrixXd prior_covariance() const;
  void members(SavedState& state);

 private:
  struct Sums {
    Eigen::MatrixXd common;    ///< picture times derivative, 3 rows
    Eigen::MatrixXd strength;  ///< picture times picture, of the same samples
    Eigen::VectorXd prior;     ///< a row for each gain, in units of the equations
    void members(SavedState& state);
  };
  std::vector<Sums> photos_;
};

/// Standard error of a gain where the values are not given: `error` at given ones, and what their
/// `covariance` makes of it through the `slopes` of its logarithm. At most that of the prior.
Colorf joint_gain_error(const Colorf& gain, const Colorf& error, const Eigen::MatrixXd& slopes,
                        const Eigen::MatrixXd& covariance);

}  // namespace selenite
