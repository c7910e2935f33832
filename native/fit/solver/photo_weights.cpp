// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/photo_weights.h"

#include <algorithm>
#include <cmath>

#include "fit/problem/saved_state.h"

namespace selenite {

PhotoWeights::PhotoWeights(const std::vector<Photo>& photos, const PixelWeightsOptions& options)
    : photos_(&photos), options_(options), next_(options.first_weighing) {
  for (const Photo& photo : photos) {
    weights_.push_back(relative_weights(photo, photos.size(), options_));
    variances_.push_back(Eigen::VectorXf::Zero(weights_.back().size()));
  }
}

Eigen::VectorXf PhotoWeights::by_variance(std::size_t i, const Eigen::VectorXf& variance) const {
  return noise_weights((*photos_)[i], photos_->size(), variance, options_);
}

bool PhotoWeights::learn(std::span<const Observation> seen, double keep, int iteration) {
  renders_ = keep * renders_ + 1;
  for (const Observation& one : seen) {
    Eigen::VectorXf& sum = variances_[static_cast<std::size_t>(one.photo)];
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r, sum.size());
    sum =
        sum * static_cast<float>(keep) + variance.cwiseMax(0.f) * static_cast<float>(one.film.spp);
  }
  if (iteration != next_) return false;
  next_ *= 2;
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const Photo& photo = (*photos_)[i];
    weights_[i] =
        by_variance(i, box_blur(variances_[i], photo.width, photo.height, options_.noise_radius) /
                           static_cast<float>(renders_));
  }
  return true;
}

NoisyLoss PhotoWeights::loss(std::span<const Observation> seen,
                             const std::vector<Halves>& halves) const {
  NoisyLoss loss;
  for (std::size_t v = 0; v < halves.size(); ++v) {
    const Halves& half = halves[v];
    const Eigen::VectorXf& weights = weights_[static_cast<std::size_t>(seen[v].photo)];
    for (Eigen::Index i = 0; i < half.variance.size(); i += 3) {
      double spread = 0;  // the channels of a pixel vary together
      for (Eigen::Index j = i; j < i + 3; ++j) {
        const double weight = weights[j], variance = half.variance[j];
        const double product =
            static_cast<double>(half.residual_a[j]) * static_cast<double>(half.residual_b[j]);
        loss.value += weight * product;
        spread += weight * std::sqrt(2 * std::max(product, 0.0) * variance + variance * variance);
      }
      loss.variance += spread * spread;
    }
  }
  return loss;
}

void PhotoWeights::members(SavedState& state) { state(weights_, variances_, renders_, next_); }

}  // namespace selenite
