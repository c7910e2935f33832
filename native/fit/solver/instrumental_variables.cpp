// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/instrumental_variables.h"

#include <cmath>

#include "fit/problem/pixel_weights.h"

namespace selenite {

void InstrumentalVariables::members(SavedState& state) { state(parts_[0], parts_[1], adds_); }

void InstrumentalVariables::Part::members(SavedState& state) { state(a, b, weight); }

void InstrumentalVariables::add(const Halves& halves, double keep, double weight) {
  const float kept = static_cast<float>(keep), fresh = static_cast<float>(weight);
  const Eigen::Index columns = halves.jacobian_a.cols();
  adds_.resize(static_cast<std::size_t>(columns));
  for (Part& part : parts_) {
    if (part.weight.size() == 0) {
      part.a = part.b = Jacobian::Zero(halves.jacobian_a.rows(), columns);
      part.weight = Eigen::VectorXd::Zero(columns);
    }
    part.a *= kept;
    part.b *= kept;
    part.weight *= keep;
  }
  for (Eigen::Index k = 0; k < columns; ++k) {
    if (!halves.differentiated[k]) continue;
    // 0 1 1 0 0 1 1 0 ...: differences from above and from below, which take turns, are in both.
    int& adds = adds_[static_cast<std::size_t>(k)];
    Part& now = parts_[static_cast<std::size_t>((adds + 1) / 2 % 2)];
    ++adds;
    now.a.col(k) += fresh * halves.jacobian_a.col(k);
    now.b.col(k) += fresh * halves.jacobian_b.col(k);
    now.weight[k] += weight;
  }
}

InstrumentalVariables::Set InstrumentalVariables::all(const SlotLayout& layout, const Photo& photo,
                                                      const Eigen::VectorXf& importance,
                                                      const Progress* progress) const {
  return {half(layout, photo, &Part::a, importance, progress),
          half(layout, photo, &Part::b, importance, progress)};
}

InstrumentalVariables::Set InstrumentalVariables::plain() const {
  Set set{means(&Part::a), means(&Part::b)};
  for (Half* one : {&set.a, &set.b}) one->filtered = one->slopes;
  return set;
}

InstrumentalVariables::Half InstrumentalVariables::means(Jacobian Part::*which) const {
  const auto& [first, second] = parts_;
  const Eigen::Index rows = (first.*which).rows(), columns = (first.*which).cols();
  Half result;
  for (Jacobian* one : {&result.slopes, &result.noise}) one->setZero(rows, columns);
  for (Eigen::Index k = 0; k < columns; ++k) {
    const double all = first.weight[k] + second.weight[k];
    if (all == 0) continue;  // no picture had it yet
    result.slopes.col(k) =
        ((first.*which).col(k) + (second.*which).col(k)) / static_cast<float>(all);
    if (first.weight[k] == 0 || second.weight[k] == 0) {
      result.noise.col(k) = result.slopes.col(k);  // nothing is known of it yet
      continue;
    }
    // Their difference has the variance 1 / w1 + 1 / w2, the mean of all 1 / (w1 + w2).
    result.noise.col(k) = ((first.*which).col(k) / static_cast<float>(first.weight[k]) -
                           (second.*which).col(k) / static_cast<float>(second.weight[k])) *
                          static_cast<float>(std::sqrt(share(k)));
  }
  return result;
}

double InstrumentalVariables::share(Eigen::Index k) const {
  const double first = parts_[0].weight[k], second = parts_[1].weight[k];
  return first * second / ((first + second) * (first + second));
}

InstrumentalVariables::Half InstrumentalVariables::half(const SlotLayout& layout,
                                                        const Photo& photo, Jacobian Part::*which,
                                                        const Eigen::VectorXf& importance,
                                                        const Progress* progress) const {
  const auto& [first, second] = parts_;
  Half result = means(which);
  result.filtered = result.slopes;
  for (Eigen::Index k = 0; k < result.slopes.cols(); ++k) {
    throw_if_cancelled(progress);
    if (first.weight[k] + second.weight[k] == 0) continue;
    const int channel = layout.rows[static_cast<std::size_t>(k)].channel;
    const Eigen::VectorXf slope = result.slopes.col(k);
    if (share(k) == 0) {
      result.filtered.col(k) = box_blur(clipped_derivative(slope, photo, channel, options_.filter),
                                        photo.width, photo.height, options_.first_blur_radius);
      continue;
    }
    const Eigen::VectorXf one = (first.*which).col(k) / static_cast<float>(first.weight[k]);
    const Eigen::VectorXf other = (second.*which).col(k) / static_cast<float>(second.weight[k]);
    result.filtered.col(k) = filtered_derivative(slope, one, other, share(k), photo, channel,
                                                 importance, options_.filter);
  }
  return result;
}

}  // namespace selenite
