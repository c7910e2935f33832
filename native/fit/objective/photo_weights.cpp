// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/photo_weights.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/objective/closed_form_gain.h"
#include "fit/objective/shared_residual.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

/// The number of a photo for which weights are learned; empty: it is another one.
std::optional<std::size_t> weighed(const Problem& problem, const Photo& photo) {
  if (problem.weights)
    for (std::size_t i = 0; i < problem.photos.size(); ++i)
      if (&problem.photos[i] == &photo) return i;
  return std::nullopt;
}

}  // namespace

LossResult evaluate_loss(const Problem& problem, std::size_t i, const Film& film) {
  const Photo& photo = problem.photos[i];
  if (!problem.weights) return problem.loss.evaluate(film, photo);
  return problem.loss.evaluate_by(film, photo, problem.weights->of_loss(i));
}

Eigen::VectorXf gain_weights(const Problem& problem, const Photo& photo) {
  const auto i = weighed(problem, photo);
  if (!i) return relative_weights(photo, 1);
  return (*problem.weights)[*i] * static_cast<float>(problem.photos.size());
}

double gain_prior(const Problem& problem, const Photo& photo) {
  const auto i = weighed(problem, photo);
  return gain_prior_strength(i ? problem.weights->count(*i) : count_of(photo));
}

PhotoWeights::PhotoWeights(const std::vector<Photo>& photos, bool weighted,
                           const PixelWeightsOptions& options)
    : photos_(&photos), weighted_(weighted), options_(options), next_(options.first_weighing) {
  for (const Photo& photo : photos) {
    weights_.push_back(weighted ? relative_weights(photo, photos.size(), options_)
                                : shares(photo, photos.size()));
    const Eigen::VectorXf none = Eigen::VectorXf::Zero(weights_.back().size());
    sums_.push_back({none, none, none, {}, {}});
    counts_.push_back(count_of(photo));
  }
}

Eigen::VectorXf PhotoWeights::of_loss(std::size_t i) const {
  return weights_[i] * static_cast<float>(scale_ * static_cast<double>(photos_->size()));
}

Eigen::VectorXf PhotoWeights::by_variance(std::size_t i, const Eigen::VectorXf& variance) const {
  if (!weighted_) return weights_[i];
  const Photo& photo = (*photos_)[i];
  if (products_.empty()) return noise_weights(photo, photos_->size(), variance, options_);
  return shares(photo, photos_->size())
      .cwiseProduct(
          model_.precision({photo, residual_variance(photo, variance, options_), products_[i]}, i));
}

bool PhotoWeights::learn(std::span<const Observation> seen, double keep, int iteration) {
  if (!weighted_) return false;
  renders_ = keep * renders_ + 1;
  const auto kept = static_cast<float>(keep);
  for (const Observation& one : seen) {
    const auto i = static_cast<std::size_t>(one.photo);
    Sums& sums = sums_[i];
    const Eigen::Map<const Eigen::VectorXf> variance(&one.film.variance.front().r,
                                                     sums.variance.size());
    sums.variance =
        sums.variance * kept + variance.cwiseMax(0.f) * static_cast<float>(one.film.spp);
    Halves halves = residual_halves(one.film, (*photos_)[i]);
    sums.half_a = sums.half_a * kept + halves.residual_a;
    sums.half_b = sums.half_b * kept + halves.residual_b;
    sums.newest_a = std::move(halves.residual_a);
    sums.newest_b = std::move(halves.residual_b);
  }
  if (iteration < next_) return false;
  while (next_ <= iteration) next_ *= 2;
  weigh(false);
  return true;
}

void PhotoWeights::weigh_answer() {
  if (weighted_ && renders_ > 0) weigh(true);
}

bool PhotoWeights::is_unexplained() const {
  SharedResidual shared;
  for (std::size_t i = 0; i < sums_.size(); ++i)
    if (sums_[i].newest_a.size() > 0)
      shared.add((*photos_)[i], sums_[i].newest_a, sums_[i].newest_b, weights_[i]);
  return shared.square > options_.model_error_sigmas * std::sqrt(shared.variance);
}

void PhotoWeights::weigh(bool of_answer) {
  const auto renders = static_cast<float>(renders_);
  std::vector<PhotoResiduals> residuals;
  std::vector<Eigen::VectorXf> variances;
  products_.clear();
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    const Photo& photo = (*photos_)[i];
    const Sums& sums = sums_[i];
    variances.push_back(box_blur(sums.variance, photo.width, photo.height, options_.noise_radius) /
                        renders);
    products_.push_back(sums.half_a.cwiseProduct(sums.half_b) / (renders * renders));
    residuals.push_back(
        {photo, residual_variance(photo, variances.back(), options_), products_.back()});
  }
  model_ = ResidualModel(residuals);
  const bool plain = model_.size(residuals) >= options_.plain_model_error;
  if (!plain && !(of_answer && is_unexplained())) {
    model_ = ResidualModel();
    products_.clear();
  }
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    weights_[i] = by_variance(i, variances[i]);
    const Photo& photo = (*photos_)[i];
    const Eigen::VectorXf residual = (sums_[i].half_a + sums_[i].half_b) / (2 * renders);
    counts_[i] =
        products_.empty()
            ? count_of(photo)
            : independent_count(photo, weights_[i] * static_cast<float>(weights_.size()), residual);
  }
  set_scale();
  ++version_;
}

/// So that a residual of a pixel's brightness everywhere has the loss 1.
void PhotoWeights::set_scale() {
  double sum = 0;
  for (std::size_t i = 0; i < weights_.size(); ++i)
    sum += weights_[i].cast<double>().dot(
        brightness((*photos_)[i], options_).cwiseAbs2().cast<double>());
  scale_ = 1 / sum;
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

void PhotoWeights::Sums::members(SavedState& state) {
  state(variance, half_a, half_b, newest_a, newest_b);
}

void PhotoWeights::members(SavedState& state) {
  state(weights_, sums_, renders_, next_, version_, model_, products_, counts_, scale_);
}

}  // namespace selenite
