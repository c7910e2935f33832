// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/evaluate/half_buffers.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {

class SavedState;

/// A sum of products of independent halves, and its variance.
struct NoisyLoss {
  double value = 0, variance = 0;
};

/// Weights of the residuals of each photo: first relative to its brightness, then by the noise of the
/// renders as well.
///
/// That noise is learned pixel by pixel, from seeds of earlier iterations only, and enters the weights
/// at few iterations: the start may be far from where the noise (caustics, say) will be. Equations in
/// older weights stay true: they are about the same unknowns.
class PhotoWeights {
 public:
  /// `photos` must outlive it.
  explicit PhotoWeights(const std::vector<Photo>& photos, const PixelWeightsOptions& options = {});

  /// Of the residuals of photo i, 3 numbers a pixel; they sum to about 1 / brightness^2.
  const Eigen::VectorXf& operator[](std::size_t i) const { return weights_[i]; }
  /// The same, by the variance of one sample.
  Eigen::VectorXf by_variance(std::size_t i, const Eigen::VectorXf& variance) const;
  /// Adds the noise of an iteration; of that before, the share `keep` stays. Whether the weights have
  /// changed: losses in other weights do not compare.
  bool learn(std::span<const Observation> seen, double keep, int iteration);
  /// The weighted sum of squares, without the bias of noise.
  NoisyLoss loss(std::span<const Observation> seen, const std::vector<Halves>& halves) const;
  void members(SavedState& state);

 private:
  const std::vector<Photo>* photos_;
  PixelWeightsOptions options_;
  std::vector<Eigen::VectorXf> weights_;
  std::vector<Eigen::VectorXf> variances_;  ///< of one sample, summed over recent iterations
  double renders_ = 0;                      ///< in `variances_`
  int next_;                                ///< iteration at which the noise enters the weights
};

}  // namespace selenite
