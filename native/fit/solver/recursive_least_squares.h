// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/objective/half_buffers.h"
#include "fit/solver/instrumental_variables.h"

namespace selenite {

/// Sums over the pixels of one iteration's renders. Z are the instruments, J the Jacobian, w the
/// weights of the residuals; columns are unknowns in `Reparametrization`.
struct Measurement {
  Eigen::MatrixXd normal;      ///< Z^T w J, one half-buffer with the other; not symmetric
  Eigen::MatrixXd covariance;  ///< of `gradient`
  Vector gradient;             ///< Z^T w (I - photo)
  Vector strength;             ///< diagonal of Z^T w Z

  explicit Measurement(Eigen::Index unknowns);
  /// Adds a photo, whose instruments are `z`.
  void add(const InstrumentalVariables::Set& z, const Eigen::VectorXf& weight,
           const Halves& halves);
  /// The same for the gradient alone: what is added to residuals beside the photo.
  void add_gradient(const InstrumentalVariables::Set& z, const Eigen::VectorXf& weight,
                    const Halves& halves);
};

/// The normal equations of all iterations: `normal` u = `right`. Each iteration's equations hold
/// wherever it was made; older ones count less.
class RecursiveLeastSquares {
 public:
  explicit RecursiveLeastSquares(Eigen::Index unknowns) : sum_(unknowns) {}
  /// Joins equations made at `u`; of those before, the share `keep` stays.
  void join(const Measurement& now, const Vector& u, double keep);
  void reset();

  const Eigen::MatrixXd& normal() const { return sum_.normal; }
  const Vector& right() const { return sum_.gradient; }
  const Eigen::MatrixXd& covariance() const { return sum_.covariance; }  ///< of `right`
  const Vector& strength() const { return sum_.strength; }
  void members(SavedState& state);

 private:
  Measurement sum_;  ///< `gradient` is the right-hand side
};

}  // namespace selenite
