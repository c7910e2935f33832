// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/unknowns.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "ClusterOptions".
struct ClusterOptions {
  int blocks = 10;     ///< along the longer side of a photo
  int least_side = 4;  ///< of a block, in pixels
  /// Standard deviations by which the scatter of blocks must exceed that of pixels to count.
  double block_sigmas = 3;
  std::size_t least_photos = 3;  ///< for a jackknife over them
  double most_leverage = 0.9;    ///< share of a direction that a deleted photo may hold
};

/// What a group of pixels adds to the normal equations.
struct Cluster {
  Vector score;            ///< its part of the gradient
  Eigen::MatrixXd normal;  ///< and of the normal matrix
  explicit Cluster(Eigen::Index n = 0)
      : score(Vector::Zero(n)), normal(Eigen::MatrixXd::Zero(n, n)) {}
  void members(SavedState& state) { state(score, normal); }
};

/// The parts of the normal equations by photos and by blocks of pixels.
///
/// Where a model error remains, residuals of neighbours, and of all pixels of a photo, go together. Then
/// the scatter of their sums says how sure the values are, which the scatter of single pixels does not.
/// Source: Liang and Zeger 1986, Biometrika 73 (sandwich of clusters); docs/method/confidence.md,
/// "Errors that pixels share".
class ClusteredScores {
 public:
  ClusteredScores() = default;
  ClusteredScores(Eigen::Index n, const ClusterOptions& options) : n_(n), options_(options) {}

  /// Begins a photo; pixels that follow are its own.
  void begin_photo(const Photo& photo);
  void add(std::size_t pixel, const Vector& score, const Eigen::MatrixXd& normal);
  /// By component of `free`: the factor of its standard error, at least 1.
  ///
  /// `inverse` of the normal matrix and `step`, of these components; `variance`: as of independent
  /// pixels. The larger of the two scatters counts, where it exceeds what chance gives: of few photos
  /// with the quantile of Student's t.
  Vector widening(const std::vector<Eigen::Index>& free, const Eigen::MatrixXd& inverse,
                  const Vector& step, const Vector& variance) const;
  void members(SavedState& state) { state(n_, photos_, blocks_); }

 private:
  /// Of their sum, by how the clusters scatter around their mean.
  Vector variance_of(const std::vector<Cluster>& clusters, const std::vector<Eigen::Index>& free,
                     const Eigen::MatrixXd& inverse, const Vector& step) const;
  /// The same of the photos by a jackknife that deletes each in turn, in closed form: a photo that rules
  /// the step has small scores, as these vanish where it wants the values.
  Vector variance_of_photos(const std::vector<Eigen::Index>& free, const Eigen::MatrixXd& inverse,
                            const Vector& step) const;
  Vector deleted(const Vector& moves, const Eigen::MatrixXd& leverage) const;

  Eigen::Index n_ = 0;
  ClusterOptions options_;
  std::vector<Cluster> photos_, blocks_;
  std::size_t first_block_ = 0;  ///< of the present photo
  int width_ = 1, side_ = 1, columns_ = 1;
};

/// Quantile at 0.95 of Student's t, and at 0.99 of chi-square over its mean.
double student_quantile_95(std::size_t degrees_of_freedom);
double chi_square_ratio_99(std::size_t degrees_of_freedom);

}  // namespace selenite
