// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/instruments.h"

#include <algorithm>
#include <cmath>

#include "fit/band_gains.h"
#include "fit/saved_state.h"
#include "fit/weights.h"

namespace selenite {
namespace {

// Source: facts sheet "estimators", Q2, step 4.
constexpr double kClipQuantile = 0.998;
constexpr int kBlurRadius = 1;  ///< of the first ones, of which nothing is known yet
/// Every so many entries are looked at for the quantile: it need not be exact.
constexpr Eigen::Index kQuantileStride = 5;

Eigen::Map<const Eigen::VectorXf> as_vector(const Picture& picture) {
  static_assert(sizeof(Colorf) == 3 * sizeof(float));
  return {&picture.front().r, static_cast<Eigen::Index>(3 * picture.size())};
}

/// Mean over the odd samples, from all and even ones.
Eigen::VectorXf odd_half(const Film& film, const Picture& mean, const Picture& even) {
  const int even_count = (film.spp + 1) / 2;
  const float all = static_cast<float>(film.spp), n_even = static_cast<float>(even_count);
  return (as_vector(mean) * all - as_vector(even) * n_even) / (all - n_even);
}

/// Writes one column; a diagonal colour shows in one channel only.
void set_column(Jacobian& jacobian, Eigen::Index column, const Eigen::VectorXf& values, int channel,
                float slope) {
  if (channel < 0) {
    jacobian.col(column) = values * slope;
    return;
  }
  jacobian.col(column).setZero();
  for (Eigen::Index i = channel; i < values.size(); i += 3) jacobian(i, column) = values[i] * slope;
}

/// Cuts a column at a quantile of its absolute values: single paths must not rule it.
void clip(Eigen::Ref<Eigen::VectorXf> column, const Capture& capture, int channel) {
  std::vector<float> sizes;
  for (Eigen::Index i = 0; i < column.size(); i += kQuantileStride) {
    const bool counts = channel < 0 || i % 3 == channel;
    if (counts && capture.weight[static_cast<std::size_t>(i / 3)] > 0)
      sizes.push_back(std::abs(column[i]));
  }
  if (sizes.empty()) return;
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(
                                      kClipQuantile * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  column = column.cwiseMax(-*at).cwiseMin(*at);
}

Eigen::VectorXf clipped(Eigen::VectorXf column, const Capture& capture, int channel) {
  clip(column, capture, channel);
  return column;
}

}  // namespace

Halves residual_halves(const Film& film, const Capture& capture) {
  Halves halves;
  halves.residual_a = as_vector(film.half_a) - as_vector(capture.reference);
  halves.residual_b = odd_half(film, film.mean, film.half_a) - as_vector(capture.reference);
  halves.variance = as_vector(film.variance) * 2;
  return halves;
}

Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope) {
  const Film& film = seen.film;
  const Capture& capture = problem.captures[static_cast<std::size_t>(seen.capture)];
  const auto unknowns = static_cast<Eigen::Index>(problem.layout.rows.size());
  const Eigen::Index rows = as_vector(film.mean).size();
  Halves halves = residual_halves(film, capture);
  halves.jacobian_a.resize(rows, unknowns);
  halves.jacobian_b.resize(rows, unknowns);
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    const UnknownRow& row = problem.layout.rows[static_cast<std::size_t>(k)];
    const SlotFilm& slot = film.slots[static_cast<std::size_t>(row.slot)];
    const float scale = static_cast<float>(slope[k]);
    set_column(halves.jacobian_a, k, as_vector(slot.half_a), row.channel, scale);
    set_column(halves.jacobian_b, k, odd_half(film, slot.mean, slot.half_a), row.channel, scale);
  }
  return halves;
}

void JacobianSums::members(SavedState& state) { state(sum_a_, sum_b_, weight_); }

JacobianSums::Set JacobianSums::add(const Problem& problem, const Capture& capture,
                                    const Halves& halves, const Eigen::VectorXf& importance,
                                    double keep, double weight) {
  const bool first = weight_ == 0;
  const float kept = static_cast<float>(keep), fresh = static_cast<float>(weight);
  if (first) {
    sum_a_ = sum_b_ = Jacobian::Zero(halves.jacobian_a.rows(), halves.jacobian_a.cols());
  } else {
    sum_a_ *= kept;
    sum_b_ *= kept;
    weight_ *= keep;
  }
  const float before = static_cast<float>(weight_), after = before + fresh;
  Set set;
  set.for_a = (sum_a_ + sum_b_ + fresh * halves.jacobian_b) / (before + after);
  set.for_b = (sum_a_ + sum_b_ + fresh * halves.jacobian_a) / (before + after);
  set.plain_a = (sum_a_ + fresh * halves.jacobian_a) / after;
  set.plain_b = (sum_b_ + fresh * halves.jacobian_b) / after;
  set.only_a = set.plain_a;
  set.only_b = set.plain_b;
  for (Eigen::Index k = 0; k < set.for_a.cols(); ++k) {
    const int channel = problem.layout.rows[static_cast<std::size_t>(k)].channel;
    for (Jacobian* one : {&set.for_a, &set.for_b, &set.only_a, &set.only_b})
      clip(one->col(k), capture, channel);
    if (first) {
      for (Jacobian* one : {&set.for_a, &set.for_b, &set.only_a, &set.only_b})
        one->col(k) = box_blur(one->col(k), capture.width, capture.height, kBlurRadius);
      continue;
    }
    // By what was seen before: the gains share no sample with this iteration's residuals either.
    const BandGains gains(clipped(sum_a_.col(k) / before, capture, channel),
                          clipped(sum_b_.col(k) / before, capture, channel), importance,
                          capture.width, capture.height);
    // One filter for all four, that of the noise in what meets residuals: the normal matrix has to
    // be that of the equations.
    for (Jacobian* one : {&set.for_a, &set.for_b, &set.only_a, &set.only_b})
      one->col(k) = gains.filter(one->col(k), before / (before + after));
  }
  sum_a_ += fresh * halves.jacobian_a;
  sum_b_ += fresh * halves.jacobian_b;
  weight_ += weight;
  return set;
}

}  // namespace selenite
