// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/objective/half_buffers.h"
#include "fit/objective/residual_model.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {

class SavedState;

/// A sum of products of independent halves, and its variance.
struct NoisyLoss {
  double value = 0, variance = 0;
};

/// Weights of the residuals of each photo: what a fit minimises where its loss is `Loss::weighted`.
///
/// First they are relative to brightness. Then the noise of the renders joins, and the model error that
/// the residuals show (`ResidualModel`), where there is one. Both are learned from seeds of earlier iterations only, and
/// enter the weights at few iterations: the start may be far from where the noise (caustics, say) and
/// the residuals will be. Equations in older weights stay true: they are about the same unknowns. With another loss all
/// residuals weigh alike, always.
class PhotoWeights {
 public:
  /// `photos` must outlive it.
  explicit PhotoWeights(const std::vector<Photo>& photos, bool weighted = true,
                        const PixelWeightsOptions& options = {});

  /// Independent residuals of photo i.
  double count(std::size_t i) const { return counts_[i]; }
  /// What a loss multiplies the weights by, times the number of photos.
  double scale() const { return scale_; }
  /// Of the residuals of photo i, 3 numbers a pixel; at first they sum to about 1 / brightness^2.
  const Eigen::VectorXf& operator[](std::size_t i) const { return weights_[i]; }
  /// The same as a loss takes them: a weighted sum of squares over a photo is its mean square relative
  /// to the photo's brightness, whatever has been learned.
  Eigen::VectorXf of_loss(std::size_t i) const;
  /// The same as `[]`, by the variance of one sample.
  Eigen::VectorXf by_variance(std::size_t i, const Eigen::VectorXf& variance) const;
  /// Adds residuals and noise of an iteration; of those before, the share `keep` stays. Whether the
  /// weights have changed: losses in other weights do not compare.
  bool learn(std::span<const Observation> seen, double keep, int iteration);
  /// Puts all that has been learned into the weights, now that the residuals are those of the answer: a
  /// model error too, if it is significant.
  void weigh_answer();
  /// Grows with each change.
  int version() const { return version_; }
  /// By the newest residuals that were weighed.
  const ModelError& model_error() const { return model_.error(); }
  /// The weighted sum of squares, without the bias of noise.
  NoisyLoss loss(std::span<const Observation> seen, const std::vector<Halves>& halves) const;
  void members(SavedState& state);

 private:
  /// Sums over recent iterations.
  struct Sums {
    Eigen::VectorXf variance;            ///< of one sample
    Eigen::VectorXf half_a, half_b;      ///< of the residuals
    Eigen::VectorXf newest_a, newest_b;  ///< those of the last iteration alone
    void members(SavedState& state);
  };
  void weigh(bool of_answer);
  /// Whether neighbouring pixels share their newest residuals beyond noise. Sums over iterations know more,
  /// but also what the values were off by on their way: all iterations together leave the answer an error
  /// that lies below the noise of one.
  bool is_unexplained() const;
  void set_scale();

  const std::vector<Photo>* photos_;
  bool weighted_;
  PixelWeightsOptions options_;
  std::vector<Eigen::VectorXf> weights_;
  std::vector<Sums> sums_;
  double renders_ = 0;  ///< in `sums_`
  int next_;            ///< iteration at which they enter the weights
  int version_ = 0;
  ResidualModel model_;
  std::vector<double> counts_;
  std::vector<Eigen::VectorXf> products_;  ///< residuals as of the newest weights; empty: none yet
  double scale_ = 1;                       ///< of `of_loss`
};

/// Precisions of a photo's residuals times their shares, which sum to 1: of one of the problem's photos
/// by what has been learned, of another by its brightness.
Eigen::VectorXf gain_weights(const Problem& problem, const Photo& photo);
/// Strength of the prior of a photo's gain beside these weights. Where a model error has been learned its
/// pixels are not independent, and the prior counts the more.
double gain_prior(const Problem& problem, const Photo& photo);

/// The loss of photo i, by what has been learned so far.
LossResult evaluate_loss(const Problem& problem, std::size_t i, const Film& film);

}  // namespace selenite
