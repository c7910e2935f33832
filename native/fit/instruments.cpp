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

/// A column cut at a quantile of its absolute values: single paths must not rule it.
Eigen::VectorXf clipped(const Eigen::VectorXf& column, const Capture& capture, int channel) {
  std::vector<float> sizes;
  for (Eigen::Index i = 0; i < column.size(); i += kQuantileStride) {
    const bool counts = channel < 0 || i % 3 == channel;
    if (counts && capture.weight[static_cast<std::size_t>(i / 3)] > 0)
      sizes.push_back(std::abs(column[i]));
  }
  if (sizes.empty()) return column;
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(
                                      kClipQuantile * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  return column.cwiseMax(-*at).cwiseMin(*at);
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

Eigen::VectorXf instrument_of(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                              const Eigen::VectorXf& other, double share, const Capture& capture,
                              int channel, const Eigen::VectorXf& importance) {
  const BandGains gains(clipped(one, capture, channel), clipped(other, capture, channel),
                        importance, capture.width, capture.height);
  // In units of the mean variance of the two.
  return gains.filter(clipped(mean, capture, channel), static_cast<float>(2 * share));
}

void JacobianSums::members(SavedState& state) { state(parts_[0], parts_[1], adds_); }

void JacobianSums::Part::members(SavedState& state) { state(a, b, weight); }

JacobianSums::Set JacobianSums::add(const Problem& problem, const Capture& capture,
                                    const Halves& halves, const Eigen::VectorXf& importance,
                                    double keep, double weight) {
  const float kept = static_cast<float>(keep), fresh = static_cast<float>(weight);
  // 0 1 1 0 0 1 1 0 ...: secants from above and from below, which take turns, are in both.
  Part& now = parts_[static_cast<std::size_t>((adds_ + 1) / 2 % 2)];
  for (Part& part : parts_) {
    if (adds_ == 0)
      part.a = part.b = Jacobian::Zero(halves.jacobian_a.rows(), halves.jacobian_a.cols());
    part.a *= kept;
    part.b *= kept;
    part.weight *= keep;
  }
  now.a += fresh * halves.jacobian_a;
  now.b += fresh * halves.jacobian_b;
  now.weight += weight;
  ++adds_;
  return {half(problem, capture, &Part::a, importance),
          half(problem, capture, &Part::b, importance)};
}

JacobianSums::Half JacobianSums::half(const Problem& problem, const Capture& capture,
                                      Jacobian Part::*which,
                                      const Eigen::VectorXf& importance) const {
  const auto& [first, second] = parts_;
  const double all = first.weight + second.weight;
  Half result;
  result.slopes = (first.*which + second.*which) / static_cast<float>(all);
  result.instruments.resize(result.slopes.rows(), result.slopes.cols());
  const auto channel_of = [&](Eigen::Index k) {
    return problem.layout.rows[static_cast<std::size_t>(k)].channel;
  };
  if (first.weight == 0 || second.weight == 0) {
    for (Eigen::Index k = 0; k < result.slopes.cols(); ++k)
      result.instruments.col(k) = box_blur(clipped(result.slopes.col(k), capture, channel_of(k)),
                                           capture.width, capture.height, kBlurRadius);
    result.noise = result.slopes;  // nothing is known of it yet
    return result;
  }
  const Jacobian one = first.*which / static_cast<float>(first.weight);
  const Jacobian other = second.*which / static_cast<float>(second.weight);
  // Their difference has the variance 1 / w1 + 1 / w2, the mean of all 1 / (w1 + w2).
  const double share = first.weight * second.weight / (all * all);
  result.noise = (one - other) * static_cast<float>(std::sqrt(share));
  for (Eigen::Index k = 0; k < result.slopes.cols(); ++k)
    result.instruments.col(k) = instrument_of(result.slopes.col(k), one.col(k), other.col(k), share,
                                              capture, channel_of(k), importance);
  return result;
}

}  // namespace selenite
