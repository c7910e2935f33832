// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace selenite {

/// Singular directions of a normal matrix Z^T w J: what `values[j]` times `in.col(j)` of the unknowns
/// does to the equations is along `out.col(j)`.
///
/// Each column of the instruments Z has a filter of its own, so the matrix is not symmetric. To make
/// it so would be wrong just where unknowns can nearly make up for each other: there J has no change
/// left to show, but the instruments see one in the transposed half. For a symmetric matrix these are
/// its eigenvectors and eigenvalues; a value below 0 means that noise rules.
struct SingularDirections {
  Eigen::MatrixXd out, in;
  Eigen::VectorXd values;

  explicit SingularDirections(const Eigen::MatrixXd& normal);
};

}  // namespace selenite
