// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/gain_slopes.h"

#include <algorithm>
#include <cmath>

#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {

GainSlopes::GainSlopes(const Problem& problem) {
  const Eigen::Index n = problem.unknowns.size();
  for (const Photo& photo : problem.photos) {
    const Eigen::Index rows = photo.gain_freedom == GainFreedom::kNone ? 0 : 3;
    const Eigen::Index gains = photo.gain_freedom == GainFreedom::kScalar ? 1 : rows;
    photos_.push_back({Eigen::MatrixXd::Zero(rows, n), Eigen::MatrixXd::Zero(rows, n),
                       Eigen::VectorXd::Zero(gains)});
  }
}

void GainSlopes::add(const Problem& problem, const Observation& derivatives, const Vector& slope,
                     double weight) {
  const auto index = static_cast<std::size_t>(derivatives.photo);
  const Photo& photo = problem.photos[index];
  if (photo.gain_freedom == GainFreedom::kNone) return;
  const Film& film = derivatives.film;
  if (film.mean.empty()) return;  // of a difference alone
  const Eigen::VectorXf weights = gain_weights(problem, photo);
  const auto products = [&](const Picture& other, const Picture& covariance) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < film.size(); ++i)
      for (int c = 0; c < 3; ++c)
        sum[c] += static_cast<double>(weights[static_cast<Eigen::Index>(3 * i) + c]) *
                  (static_cast<double>(film.mean[i][c]) * static_cast<double>(other[i][c]) -
                   static_cast<double>(covariance[i][c]));
    return sum;
  };
  const auto joined = [&](Eigen::Vector3d sums) {
    if (photo.gain_freedom == GainFreedom::kScalar) sums.setConstant(sums.sum());
    return sums;
  };
  const double prior = gain_prior(problem, photo);
  const Eigen::Vector3d strength =
      joined(products(film.mean, film.variance)).cwiseMax(0) + Eigen::Vector3d::Constant(prior);
  Sums& sums = photos_[index];
  for (Eigen::Index c = 0; c < sums.prior.size(); ++c)
    sums.prior[c] =
        prior_in_equations(prior, strength[c]) / static_cast<double>(problem.photos.size());
  for (Eigen::Index k = 0; k < slope.size(); ++k) {
    const UnknownRow& row = problem.layout.rows[static_cast<std::size_t>(k)];
    const SlotFilm& slot = film.slots[static_cast<std::size_t>(row.slot)];
    if (slot.mean.empty()) continue;
    Eigen::Vector3d common = products(slot.mean, slot.covariance);
    for (int c = 0; c < 3; ++c)
      if (row.channel >= 0 && row.channel != c) common[c] = 0;
    sums.common.col(k) += weight * slope[k] * joined(common);
    sums.strength.col(k) += weight * strength;
  }
}

std::vector<Eigen::MatrixXd> GainSlopes::slopes() const {
  std::vector<Eigen::MatrixXd> found;
  for (const Sums& sums : photos_)
    found.push_back(
        (sums.strength.array() > 0)
            .select(-sums.common.array() / sums.strength.array(), sums.common.array() * 0)
            .matrix());
  return found;
}

Eigen::MatrixXd GainSlopes::prior_covariance() const {
  const std::vector<Eigen::MatrixXd> slopes = this->slopes();
  const Eigen::Index n = photos_.empty() ? 0 : photos_.front().common.cols();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < photos_.size(); ++i)
    for (Eigen::Index c = 0; c < photos_[i].prior.size(); ++c)
      covariance += square(photos_[i].prior[c] * kGainPrior.log_deviation) *
                    slopes[i].row(c).transpose() * slopes[i].row(c);
  return covariance;
}

void GainSlopes::Sums::members(SavedState& state) { state(common, strength, prior); }
void GainSlopes::members(SavedState& state) { state(photos_); }

Colorf joint_gain_error(const Colorf& gain, const Colorf& error, const Eigen::MatrixXd& slopes,
                        const Eigen::MatrixXd& covariance) {
  if (slopes.rows() == 0 || covariance.rows() == 0) return error;
  const Eigen::Vector3d of_values = (slopes * covariance * slopes.transpose()).diagonal();
  Colorf joint;
  for (int c = 0; c < 3; ++c) {
    const double relative = static_cast<double>(error[c]) / static_cast<double>(gain[c]);
    const double both = std::sqrt(square(relative) + std::max(of_values[c], 0.0));
    joint[c] = gain[c] * static_cast<float>(std::min(both, kGainPrior.log_deviation));
  }
  return joint;
}

}  // namespace selenite
