// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/closed_form_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "fit/objective/pixel_blocks.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// Minimises a g^2 / 2 - b g + prior (log g)^2 / 2.
double gain_of(double a, double b, double prior) {
  if (!(a > 0) || !(b > 0)) return 1;  // the render is black, or noise
  double t = std::log(b / a);
  for (int step = 0; step < kGainPrior.steps; ++step) {
    const double g = std::exp(t);
    const double slope = a * g * g - b * g + prior * t;
    const double curvature = std::max(2 * a * g * g - b * g, a * g * g) + prior;
    const double way = std::clamp(slope / curvature, -1.0, 1.0);
    t -= way;
    if (std::abs(way) < 1e-12) break;
  }
  const Parameter& bounds = photo_parameter_table().rows.front();
  return std::clamp(std::exp(t), bounds.lower, bounds.upper);
}

}  // namespace

double count_of(const Photo& photo) {
  return 3 * static_cast<double>(
                 std::ranges::count_if(photo.weight, [](float weight) { return weight > 0; }));
}

double independent_count(const Photo& photo, const Eigen::VectorXf& weights,
                         const Eigen::VectorXf& residual) {
  const PixelBlocks blocks(photo.width, photo.height, kGainPrior.blocks);
  std::vector<double> scores(static_cast<std::size_t>(blocks.count));
  double strength = 0;
  for (std::size_t i = 0; i < photo.size(); ++i) {
    const int x = static_cast<int>(i) % photo.width, y = static_cast<int>(i) / photo.width;
    for (int c = 0; c < 3; ++c) {
      const auto j = static_cast<Eigen::Index>(3 * i) + c;
      const double weighted = static_cast<double>(weights[j] * photo.reference[i][c]);
      strength += weighted * photo.reference[i][c];
      scores[blocks.of(x, y)] += weighted * residual[j];
    }
  }
  double squares = 0;
  for (const double score : scores) squares += square(score);
  const double most = count_of(photo);
  return squares > strength / most ? std::max(strength / squares, 1.0) : most;
}

Colorf closed_form_gain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
                        double prior) {
  if (photo.gain_freedom == GainFreedom::kNone) return Colorf(1);
  Color<double> a, b;
  for (std::size_t i = 0; i < photo.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const double weight = weights[static_cast<Eigen::Index>(3 * i) + c];
      if (weight == 0) continue;
      const double mean = film.mean[i][c];
      a[c] += weight * (mean * mean - std::max(film.variance[i][c], 0.f));
      b[c] += weight * mean * photo.reference[i][c];
    }
  if (photo.gain_freedom == GainFreedom::kScalar)
    return Colorf(static_cast<float>(gain_of(a.r + a.g + a.b, b.r + b.g + b.b, prior)));
  return {static_cast<float>(gain_of(a.r, b.r, prior)),
          static_cast<float>(gain_of(a.g, b.g, prior)),
          static_cast<float>(gain_of(a.b, b.b, prior))};
}

Colorf gain_error(const Film& film, const Colorf& gain, const Photo& photo,
                  const Eigen::VectorXf& weights) {
  const bool together = photo.gain_freedom == GainFreedom::kScalar;
  const PixelBlocks blocks(film.width, film.height, kGainPrior.blocks);
  std::vector<Color<double>> scores(static_cast<std::size_t>(blocks.count));
  Color<double> strength;
  for (std::size_t i = 0; i < film.size(); ++i) {
    const int x = static_cast<int>(i) % film.width, y = static_cast<int>(i) / film.width;
    Color<double>& score = scores[blocks.of(x, y)];
    for (int c = 0; c < 3; ++c) {
      const double weight = weights[static_cast<Eigen::Index>(3 * i) + c], mean = film.mean[i][c];
      const double variance = std::max(film.variance[i][c], 0.f);
      strength[c] += weight * (mean * mean - variance);
      score[c] += weight * (mean * (mean - photo.reference[i][c]) - variance);
    }
  }
  Colorf error;
  for (int c = 0; c < 3; ++c) {
    double squares = 0;
    for (const Color<double>& one : scores)
      squares += square(together ? one.r + one.g + one.b : one[c]);
    const double all = together ? strength.r + strength.g + strength.b : strength[c];
    const double relative = all > 0 ? std::sqrt(squares) / all : kGainPrior.log_deviation;
    error[c] = gain[c] * static_cast<float>(std::min(relative, kGainPrior.log_deviation));
  }
  return error;
}

EliminatedGain::EliminatedGain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
                               double prior)
    : scalar_(photo.gain_freedom == GainFreedom::kScalar), prior_(prior), weights_(weights) {
  for (std::size_t i = 0; i < film.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double weight = weights[static_cast<Eigen::Index>(3 * i + c)];
      if (weight == 0) continue;
      const auto channel = static_cast<int>(c);
      const double mean = film.mean[i][channel];
      const double variance = std::max(film.variance[i][channel], 0.f);
      strength_[c] += weight * (mean * mean - variance);
      slope_[c] += weight * (mean * (mean - photo.reference[i][channel]) - variance);
    }
  if (!scalar_) return;
  strength_.fill(strength_[0] + strength_[1] + strength_[2]);
  slope_.fill(slope_[0] + slope_[1] + slope_[2]);
}

void EliminatedGain::eliminate(const Eigen::VectorXf& mean, const Eigen::VectorXf& variance,
                               const Eigen::VectorXf& covariance, int channel,
                               Eigen::Ref<Eigen::VectorXf> column) const {
  std::array<double, 3> strength{}, common{};
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    const auto c = static_cast<std::size_t>(i % 3);
    const double weight = weights_[i], value = mean[i];
    if (weight == 0) continue;
    strength[c] += weight * (value * value - std::max(variance[i], 0.f));
    if (channel < 0 || static_cast<int>(c) == channel)
      common[c] += weight * (value * static_cast<double>(column[i]) - covariance[i]);
  }
  if (scalar_) {
    strength.fill(strength[0] + strength[1] + strength[2]);
    common.fill(common[0] + common[1] + common[2]);
  }
  for (std::size_t c = 0; c < 3; ++c)
    common[c] *= strength[c] > 0 ? (1 - size(c)) / strength[c] : 0;
  for (Eigen::Index i = 0; i < column.size(); ++i)
    column[i] -= static_cast<float>(common[static_cast<std::size_t>(i % 3)]) * mean[i];
}

/// The gain minimises both: the picture's slope is that of the prior, with the other sign.
void EliminatedGain::add_prior(const Eigen::VectorXf& mean,
                               Eigen::Ref<Eigen::VectorXf> residual) const {
  std::array<double, 3> share{};
  for (std::size_t c = 0; c < 3; ++c)
    if (strength_[c] > 0) share[c] = slope_[c] / strength_[c] * (1 / size(c) - 1);
  for (Eigen::Index i = 0; i < residual.size(); ++i)
    residual[i] += static_cast<float>(share[static_cast<std::size_t>(i % 3)]) * mean[i];
}

/// Of the prior's row beside the picture.
double EliminatedGain::size(std::size_t c) const {
  const double all = std::max(strength_[c], 0.0) + prior_;
  return std::sqrt(prior_in_equations(prior_, all) / all);
}

}  // namespace selenite
