// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/inference/clustered_scores.h"
#include "fit/objective/shared_residual.h"
#include "fit/problem/saved_state.h"
#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Normal equations at a point: sums over photos and pixels of a pass at fixed values, in
/// `Reparametrization`.
struct NormalEquations {
  Eigen::MatrixXd normal;            ///< Z^T w J; not symmetric
  Eigen::MatrixXd normal_variance;   ///< of each of its entries
  Eigen::MatrixXd score_covariance;  ///< of `gradient`, noise of the photos included
  Vector gradient;                   ///< Z^T w (I - photo)
  ClusteredScores clusters;          ///< of both, photo by photo and block by block
  SharedResidual shared;             ///< by the weights of the equations

  explicit NormalEquations(Eigen::Index n)
      : normal(Eigen::MatrixXd::Zero(n, n)),
        normal_variance(normal),
        score_covariance(normal),
        gradient(Vector::Zero(n)),
        clusters(n, {}) {}
  /// As if unknown k showed in no picture.
  void remove(Eigen::Index k);
  void members(SavedState& state) {
    state(normal, normal_variance, score_covariance, gradient, clusters, shared);
  }
  void add(const Photo& photo, const GaussNewton::PhotoEquations& equations);
};

}  // namespace selenite
