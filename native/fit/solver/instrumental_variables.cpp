// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/instrumental_variables.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/wiener_filter.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {
namespace {

// Source: docs/method/optimisation.md, "Instrument filter".
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
Eigen::VectorXf clipped(const Eigen::VectorXf& column, const Photo& photo, int channel) {
  std::vector<float> sizes;
  for (Eigen::Index i = 0; i < column.size(); i += kQuantileStride) {
    const bool counts = channel < 0 || i % 3 == channel;
    if (counts && photo.weight[static_cast<std::size_t>(i / 3)] > 0)
      sizes.push_back(std::abs(column[i]));
  }
  if (sizes.empty()) return column;
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(
                                      kClipQuantile * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  return column.cwiseMax(-*at).cwiseMin(*at);
}

}  // namespace

Halves residual_halves(const Film& film, const Photo& photo) {
  Halves halves;
  halves.residual_a = as_vector(film.half_a) - as_vector(photo.reference);
  halves.residual_b = odd_half(film, film.mean, film.half_a) - as_vector(photo.reference);
  halves.variance = as_vector(film.variance) * 2;
  return halves;
}

Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope) {
  const Film& film = seen.film;
  const Photo& photo = problem.photos[static_cast<std::size_t>(seen.photo)];
  const auto unknowns = static_cast<Eigen::Index>(problem.layout.rows.size());
  const Eigen::Index rows = as_vector(film.mean).size();
  Halves halves = residual_halves(film, photo);
  halves.jacobian_a.setZero(rows, unknowns);
  halves.jacobian_b.setZero(rows, unknowns);
  halves.differentiated.resize(unknowns);
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    const UnknownRow& row = problem.layout.rows[static_cast<std::size_t>(k)];
    const SlotFilm& slot = film.slots[static_cast<std::size_t>(row.slot)];
    halves.differentiated[k] = !slot.mean.empty();
    if (!halves.differentiated[k]) continue;
    const float scale = static_cast<float>(slope[k]);
    set_column(halves.jacobian_a, k, as_vector(slot.half_a), row.channel, scale);
    set_column(halves.jacobian_b, k, odd_half(film, slot.mean, slot.half_a), row.channel, scale);
  }
  return halves;
}

Eigen::VectorXf filtered_derivative(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                              const Eigen::VectorXf& other, double share, const Photo& photo,
                              int channel, const Eigen::VectorXf& importance) {
  const WienerFilter gains(clipped(one, photo, channel), clipped(other, photo, channel),
                        importance, photo.width, photo.height);
  // In units of the mean variance of the two.
  return gains.filter(clipped(mean, photo, channel), static_cast<float>(2 * share));
}

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
                                    const Eigen::VectorXf& importance) const {
  return {half(layout, photo, &Part::a, importance),
          half(layout, photo, &Part::b, importance)};
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

InstrumentalVariables::Half InstrumentalVariables::half(const SlotLayout& layout, const Photo& photo,
                                      Jacobian Part::*which,
                                      const Eigen::VectorXf& importance) const {
  const auto& [first, second] = parts_;
  Half result = means(which);
  result.filtered = result.slopes;
  for (Eigen::Index k = 0; k < result.slopes.cols(); ++k) {
    if (first.weight[k] + second.weight[k] == 0) continue;
    const int channel = layout.rows[static_cast<std::size_t>(k)].channel;
    const Eigen::VectorXf slope = result.slopes.col(k);
    if (share(k) == 0) {
      result.filtered.col(k) =
          box_blur(clipped(slope, photo, channel), photo.width, photo.height, kBlurRadius);
      continue;
    }
    const Eigen::VectorXf one = (first.*which).col(k) / static_cast<float>(first.weight[k]);
    const Eigen::VectorXf other = (second.*which).col(k) / static_cast<float>(second.weight[k]);
    result.filtered.col(k) =
        filtered_derivative(slope, one, other, share(k), photo, channel, importance);
  }
  return result;
}

}  // namespace selenite
