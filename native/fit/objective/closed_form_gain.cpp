// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/closed_form_gain.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "math/scalar.h"

namespace selenite {
namespace {

/// Numbers that count: the sum of weighted squares times this is a chi-square.
double count_of(const Photo& photo) {
  return 3 * static_cast<double>(
                 std::ranges::count_if(photo.weight, [](float weight) { return weight > 0; }));
}

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

double gain_prior_strength(const Photo& photo) {
  return 1 / (square(kGainPrior.log_deviation) * count_of(photo));
}

Colorf closed_form_gain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights) {
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
  const double prior = gain_prior_strength(photo);
  if (photo.gain_freedom == GainFreedom::kScalar)
    return Colorf(static_cast<float>(gain_of(a.r + a.g + a.b, b.r + b.g + b.b, prior)));
  return {static_cast<float>(gain_of(a.r, b.r, prior)),
          static_cast<float>(gain_of(a.g, b.g, prior)),
          static_cast<float>(gain_of(a.b, b.b, prior))};
}

Colorf gain_error(const Film& film, const Colorf& gain, const Photo& photo,
                  const Eigen::VectorXf& weights) {
  const bool together = photo.gain_freedom == GainFreedom::kScalar;
  const int side =
      std::max((std::max(film.width, film.height) + kGainPrior.blocks - 1) / kGainPrior.blocks, 1);
  const int columns = (film.width + side - 1) / side, rows = (film.height + side - 1) / side;
  std::vector<Color<double>> scores(static_cast<std::size_t>(columns) * rows);
  Color<double> strength;
  for (std::size_t i = 0; i < film.size(); ++i) {
    const int x = static_cast<int>(i) % film.width, y = static_cast<int>(i) / film.width;
    Color<double>& score =
        scores[static_cast<std::size_t>(y / side) * columns + static_cast<std::size_t>(x / side)];
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

void eliminate_gain(const HalfPicture& half, const Photo& photo, const Eigen::VectorXf& weights,
                    const Eigen::VectorXf& covariance, int channel,
                    Eigen::Ref<Eigen::VectorXf> column) {
  if (photo.gain_freedom == GainFreedom::kNone) return;
  std::array<double, 3> strength{}, common{};
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    const auto c = static_cast<std::size_t>(i % 3);
    const double weight = weights[i], mean = half.mean[i];
    if (weight == 0) continue;
    strength[c] += weight * (mean * mean - std::max(half.variance[i], 0.f));
    if (channel < 0 || static_cast<int>(c) == channel)
      common[c] += weight * (mean * static_cast<double>(column[i]) - covariance[i]);
  }
  if (photo.gain_freedom == GainFreedom::kScalar) {
    strength.fill(strength[0] + strength[1] + strength[2]);
    common.fill(common[0] + common[1] + common[2]);
  }
  const double prior = gain_prior_strength(photo);
  for (Eigen::Index i = 0; i < column.size(); ++i) {
    const auto c = static_cast<std::size_t>(i % 3);
    const double all = std::max(strength[c], 0.0) + prior;
    column[i] -= static_cast<float>(common[c] / all) * half.mean[i];
  }
}

}  // namespace selenite
