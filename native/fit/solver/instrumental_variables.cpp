// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/instrumental_variables.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/problem/pixel_weights.h"
#include "math/parallel_for.h"

namespace selenite {

void InstrumentalVariables::members(SavedState& state) {
  state(rows_, parts_[0], parts_[1], adds_, picture_a_, picture_b_, picture_weight_);
}

void InstrumentalVariables::Part::members(SavedState& state) {
  state(a, b, direct_a, direct_b, weight);
}

void InstrumentalVariables::add(const Halves& halves, double keep, double weight) {
  const float kept = static_cast<float>(keep), fresh = static_cast<float>(weight);
  const Eigen::Index columns = halves.jacobian_a.cols();
  adds_.resize(static_cast<std::size_t>(columns));
  rows_ = halves.jacobian_a.rows();
  for (Part& part : parts_) {
    if (part.weight.size() == 0) part.weight = Eigen::VectorXd::Zero(columns);
    for (ColumnSums* sums : {&part.a, &part.b, &part.direct_a, &part.direct_b}) sums->scale(kept);
    part.weight *= keep;
  }
  picture_a_ *= kept;
  picture_b_ *= kept;
  picture_weight_ *= keep;
  add_picture(halves, weight);
  for (Eigen::Index k = 0; k < columns; ++k) {
    if (!halves.differentiated[k]) continue;
    // 0 1 1 0 0 1 1 0 ...: differences from above and from below, which take turns, are in both.
    int& adds = adds_[static_cast<std::size_t>(k)];
    Part& now = parts_[static_cast<std::size_t>((adds + 1) / 2 % 2)];
    ++adds;
    const int channel = halves.channel.size() > 0 ? halves.channel[k] : -1;
    now.a.add(k, fresh, halves.jacobian_a.col(k), channel);
    now.b.add(k, fresh, halves.jacobian_b.col(k), channel);
    if (halves.direct_a.size() > 0 && (halves.direct_a.col(k).array() != 0).any()) {
      now.direct_a.add(k, fresh, halves.direct_a.col(k), channel);
      now.direct_b.add(k, fresh, halves.direct_b.col(k), channel);
    } else {
      for (Part& part : parts_)  // they would be the share of a part of the sums
        for (ColumnSums* sums : {&part.direct_a, &part.direct_b}) sums->clear(k);
    }
    now.weight[k] += weight;
  }
}

void InstrumentalVariables::add_picture(const Halves& halves, double weight) {
  if (picture_a_.size() == 0)
    picture_a_ = picture_b_ = Eigen::VectorXf::Zero(halves.residual_a.size());
  picture_a_ += static_cast<float>(weight) * halves.residual_a;
  picture_b_ += static_cast<float>(weight) * halves.residual_b;
  picture_weight_ += weight;
}

InstrumentalVariables::Set InstrumentalVariables::all(const SlotLayout& layout, const Photo& photo,
                                                      const Eigen::VectorXf& importance,
                                                      const Progress* progress, Denoising denoising,
                                                      int threads) const {
  Set set{means(&Part::a), means(&Part::b)};
  const std::array<std::pair<Half*, ColumnSums Part::*>, 2> halves{
      {{&set.a, &Part::a}, {&set.b, &Part::b}}};
  for (const auto& [half, which] : halves) half->filtered = half->slopes;
  const auto columns = static_cast<int>(set.a.slopes.cols());
  parallel_for(2 * columns, threads, [&](int i) {
    throw_if_cancelled(progress);
    const auto& [half, which] = halves[static_cast<std::size_t>(i % 2)];
    const Eigen::Index k = i / 2;
    if (parts_[0].weight[k] + parts_[1].weight[k] == 0) return;
    half->filtered.col(k) = filtered(layout, photo, which, importance, k, Share::kIndirect);
  });
  if (denoising == Denoising::kRegression)
    parallel_for(2, threads, [&](int i) {
      throw_if_cancelled(progress);
      const auto& [half, which] = halves[static_cast<std::size_t>(i)];
      regress(layout, photo, which, importance, *half);
    });
  parallel_for(2 * columns, threads, [&](int i) {
    const Eigen::Index k = i / 2;
    if (!has_direct(k)) return;
    throw_if_cancelled(progress);
    const auto& [half, which] = halves[static_cast<std::size_t>(i % 2)];
    auto column = half->filtered.col(k);
    column *= confirmed(column, i % 2 == 0 ? &Part::b : &Part::a, importance, k);
    clear(which, importance, column, *half, k);
    column += filtered(layout, photo, which, importance, k, Share::kDirect);
  });
  return set;
}

InstrumentalVariables::Set InstrumentalVariables::plain() const {
  Set set{means(&Part::a), means(&Part::b)};
  for (Half* one : {&set.a, &set.b}) one->filtered = one->slopes;
  return set;
}

InstrumentalVariables::Half InstrumentalVariables::means(ColumnSums Part::*which) const {
  const auto& [first, second] = parts_;
  Half result;
  for (Jacobian* one : {&result.slopes, &result.noise}) one->setZero(rows_, first.weight.size());
  for (Eigen::Index k = 0; k < first.weight.size(); ++k) {
    const double all = first.weight[k] + second.weight[k];
    if (all == 0) continue;  // no picture had it yet
    const Eigen::VectorXf in_first = (first.*which).column(k, rows_);
    const Eigen::VectorXf in_second = (second.*which).column(k, rows_);
    result.slopes.col(k) = (in_first + in_second) / static_cast<float>(all);
    if (first.weight[k] == 0 || second.weight[k] == 0) {
      result.noise.col(k) = result.slopes.col(k);  // nothing is known of it yet
      continue;
    }
    // Their difference has the variance 1 / w1 + 1 / w2, the mean of all 1 / (w1 + w2).
    result.noise.col(k) = (in_first / static_cast<float>(first.weight[k]) -
                           in_second / static_cast<float>(second.weight[k])) *
                          static_cast<float>(std::sqrt(share(k)));
  }
  return result;
}

double InstrumentalVariables::share(Eigen::Index k) const {
  const double first = parts_[0].weight[k], second = parts_[1].weight[k];
  return first * second / ((first + second) * (first + second));
}

Eigen::VectorXf InstrumentalVariables::filtered(const SlotLayout& layout, const Photo& photo,
                                                ColumnSums Part::*which,
                                                const Eigen::VectorXf& importance, Eigen::Index k,
                                                Share of) const {
  const auto& [first, second] = parts_;
  const int channel = layout.rows[static_cast<std::size_t>(k)].channel;
  const Eigen::VectorXf in_first = sum(first, which, k, of), in_second = sum(second, which, k, of);
  const Eigen::VectorXf slope =
      (in_first + in_second) / static_cast<float>(first.weight[k] + second.weight[k]);
  if (share(k) == 0)
    return box_blur(clipped_derivative(slope, photo, channel, options_.filter), photo.width,
                    photo.height, options_.first_blur_radius);
  return filtered_derivative(slope, in_first / static_cast<float>(first.weight[k]),
                             in_second / static_cast<float>(second.weight[k]), share(k), photo,
                             channel, importance, options_.filter);
}

Eigen::VectorXf InstrumentalVariables::sum(const Part& part, ColumnSums Part::*which,
                                           Eigen::Index k, Share share) const {
  const ColumnSums& direct = which == &Part::a ? part.direct_a : part.direct_b;
  if (share == Share::kDirect) return direct.column(k, rows_);
  if (direct.is_zero(k)) return (part.*which).column(k, rows_);
  return (part.*which).column(k, rows_) - direct.column(k, rows_);
}

float InstrumentalVariables::confirmed(const Eigen::VectorXf& filtered, ColumnSums Part::*other,
                                       const Eigen::VectorXf& importance, Eigen::Index k) const {
  const auto& [first, second] = parts_;
  const Eigen::VectorXf slope =
      (sum(first, other, k, Share::kIndirect) + sum(second, other, k, Share::kIndirect)) /
      static_cast<float>(first.weight[k] + second.weight[k]);
  const float power = importance.dot(filtered.cwiseAbs2());
  if (!(power > 0)) return 0;
  return std::clamp(importance.dot(filtered.cwiseProduct(slope)) / power, 0.f, 1.f);
}

void InstrumentalVariables::clear(ColumnSums Part::*which, const Eigen::VectorXf& importance,
                                  const Eigen::VectorXf& indirect, Half& half,
                                  Eigen::Index k) const {
  if (share(k) == 0) return;
  const auto& [first, second] = parts_;
  const auto in_first = static_cast<float>(first.weight[k]),
             in_second = static_cast<float>(second.weight[k]);
  const Eigen::VectorXf one = sum(first, which, k, Share::kIndirect) / in_first;
  const Eigen::VectorXf other = sum(second, which, k, Share::kIndirect) / in_second;
  const Eigen::VectorXf mean = (one * in_first + other * in_second) / (in_first + in_second);
  const float power = importance.dot(mean.cwiseAbs2());
  if (!(power > 0)) return;
  const float signal = std::clamp(importance.dot(one.cwiseProduct(other)) / power, 0.f, 1.f);
  half.slopes.col(k) += (1 - signal) * (indirect - mean);
  half.noise.col(k) -= (1 - signal) * (one - other) * static_cast<float>(std::sqrt(share(k)));
}

bool InstrumentalVariables::has_direct(Eigen::Index k) const {
  return std::ranges::any_of(parts_, [&](const Part& part) { return !part.direct_a.is_zero(k); });
}

void InstrumentalVariables::regress(const SlotLayout& layout, const Photo& photo,
                                    ColumnSums Part::*which, const Eigen::VectorXf& importance,
                                    Half& half) const {
  const auto& [first, second] = parts_;
  const auto indirect = [&](const Part& part, Eigen::Index k) {
    return sum(part, which, k, Share::kIndirect);
  };
  std::vector<Eigen::Index> noisy;
  std::vector<float> filtered;  // share of the filter's picture
  Jacobian columns(half.slopes.rows(), half.slopes.cols());
  for (Eigen::Index k = 0; k < half.slopes.cols(); ++k) {
    if (share(k) == 0) continue;
    const auto clipped = [&](const Eigen::VectorXf& column) {
      return clipped_derivative(column, photo, layout.rows[static_cast<std::size_t>(k)].channel,
                                options_.filter);
    };
    const Eigen::VectorXf in_first = indirect(first, k), in_second = indirect(second, k);
    const Eigen::VectorXf one = clipped(in_first / static_cast<float>(first.weight[k]));
    const Eigen::VectorXf other = clipped(in_second / static_cast<float>(second.weight[k]));
    const Eigen::VectorXf mean =
        clipped((in_first + in_second) / static_cast<float>(first.weight[k] + second.weight[k]));
    const double power = importance.dot(mean.cwiseAbs2());
    const double common = importance.dot(one.cwiseProduct(other));
    if (!(power > 0) || common >= options_.clear * power) continue;
    columns.col(static_cast<Eigen::Index>(noisy.size())) = mean;
    noisy.push_back(k);
    filtered.push_back(
        static_cast<float>(std::sqrt(std::max(common, 0.0) / (options_.clear * power))));
  }
  if (noisy.empty()) return;
  const Eigen::Map<const Eigen::VectorXf> reference(&photo.reference.front().r, half.slopes.rows());
  const Eigen::VectorXf picture =
      (which == &Part::a ? picture_a_ : picture_b_) / static_cast<float>(picture_weight_) +
      reference;
  const Jacobian regressions =
      local_regression(columns.leftCols(static_cast<Eigen::Index>(noisy.size())), picture,
                       importance, photo.width, photo.height, options_.regression);
  for (std::size_t i = 0; i < noisy.size(); ++i) {
    auto column = half.filtered.col(noisy[i]);
    column =
        filtered[i] * column + (1 - filtered[i]) * regressions.col(static_cast<Eigen::Index>(i));
  }
}

}  // namespace selenite
