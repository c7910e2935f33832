// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/singular_directions.h"

#include <Eigen/SVD>

namespace selenite {

SingularDirections::SingularDirections(const Eigen::MatrixXd& normal) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> solver(normal, Eigen::ComputeFullU | Eigen::ComputeFullV);
  out = solver.matrixU();
  in = solver.matrixV();
  values = solver.singularValues();
  for (Eigen::Index j = 0; j < values.size(); ++j)
    if (out.col(j).dot(in.col(j)) < 0) {
      in.col(j) = -in.col(j);
      values[j] = -values[j];
    }
}

}  // namespace selenite
