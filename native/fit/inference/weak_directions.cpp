// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/weak_directions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace selenite {

std::vector<WeakDirection> weak_directions(const Eigen::MatrixXd& covariance, const Vector& ranges,
                                           const std::vector<Eigen::MatrixXd>& gain_slopes,
                                           const WeakDirectionOptions& options) {
  std::vector<WeakDirection> found;
  const Eigen::Index n = covariance.rows();
  if (n == 0 || !covariance.allFinite()) return found;
  const Vector inverse = ranges.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(inverse.asDiagonal() * covariance *
                                                            inverse.asDiagonal());
  for (Eigen::Index j = n - 1; j >= 0; --j) {  // the widest first
    const double deviation = std::sqrt(std::max(axes.eigenvalues()[j], 0.0));
    if (deviation < options.undetermined) break;
    const Vector axis = axes.eigenvectors().col(j), size = axis.cwiseAbs();
    WeakDirection one;
    one.deviation = deviation;
    for (Eigen::Index k = 0; k < n; ++k)
      if (size[k] >= options.part * size.maxCoeff()) one.components.push_back(static_cast<int>(k));
    std::stable_sort(one.components.begin(), one.components.end(),
                     [&](int a, int b) { return size[a] > size[b]; });
    const Vector change = deviation * ranges.cwiseProduct(axis);
    for (std::size_t p = 0; p < gain_slopes.size(); ++p)
      if (gain_slopes[p].rows() > 0 &&
          (gain_slopes[p] * change).cwiseAbs().maxCoeff() >= options.gain)
        one.photos.push_back(static_cast<int>(p));
    if (one.components.size() + one.photos.size() > 1) found.push_back(std::move(one));
  }
  return found;
}

}  // namespace selenite
