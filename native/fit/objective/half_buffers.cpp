// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/half_buffers.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "fit/objective/alignment.h"
#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"

namespace selenite {
namespace {

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

}  // namespace

Eigen::VectorXf mean_residual(const Film& film, const Photo& photo) {
  return as_vector(film.mean) - as_vector(photo.reference);
}

Eigen::VectorXf mean_variance(const Film& film) { return as_vector(film.variance); }

Halves residual_halves(const Film& film, const Photo& photo) {
  Halves halves;
  halves.residual_a = as_vector(film.half_a) - as_vector(photo.reference);
  halves.residual_b = odd_half(film, film.mean, film.half_a) - as_vector(photo.reference);
  halves.variance = as_vector(film.variance) * 2;
  return halves;
}

Halves residual_halves(const Problem& problem, std::size_t i, const Film& film) {
  const Photo& photo = problem.photos[i];
  Halves halves = residual_halves(film, photo);
  if (photo.gain_freedom == GainFreedom::kNone) return halves;
  const Eigen::VectorXf weights = gain_weights(problem, photo);
  const EliminatedGain gain(film, photo, weights, gain_prior(problem, photo));
  gain.add_prior(as_vector(film.half_a), halves.residual_a);
  gain.add_prior(odd_half(film, film.mean, film.half_a), halves.residual_b);
  return halves;
}

std::vector<Halves> residual_halves(const Problem& problem, std::span<const Observation> seen) {
  std::vector<Halves> all;
  for (const Observation& one : seen)
    all.push_back(residual_halves(problem, static_cast<std::size_t>(one.photo), one.film));
  return all;
}

Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope,
                    FilmExtent extent) {
  const Film& film = seen.film;
  const Photo& photo = problem.photos[static_cast<std::size_t>(seen.photo)];
  const auto unknowns = static_cast<Eigen::Index>(problem.layout.rows.size());
  const Eigen::Index rows = as_vector(film.mean).size();
  Halves halves = residual_halves(film, photo);
  halves.jacobian_a.setZero(rows, unknowns);
  halves.jacobian_b.setZero(rows, unknowns);
  halves.differentiated.resize(unknowns);
  halves.channel.setConstant(unknowns, -1);
  Eigen::VectorXf picture_a, picture_b, weights;
  const bool has_gain = photo.gain_freedom != GainFreedom::kNone;
  if (has_gain || photo.align) {
    picture_a = as_vector(film.half_a);
    picture_b = odd_half(film, film.mean, film.half_a);
    weights = gain_weights(problem, photo);
  }
  std::optional<EliminatedGain> gain;
  if (has_gain) {
    const bool whole = extent == FilmExtent::kPhoto;
    gain.emplace(film, photo, weights, whole ? gain_prior(problem, photo) : 0.0);
    if (whole) {
      gain->add_prior(picture_a, halves.residual_a);
      gain->add_prior(picture_b, halves.residual_b);
    }
  }
  std::optional<AlignmentEquations> alignment;
  if (photo.align) alignment.emplace(photo, weights);
  const Eigen::VectorXf no_covariance = Eigen::VectorXf::Zero(rows);
  if (std::ranges::any_of(film.slots, [](const SlotFilm& one) { return !one.direct.empty(); })) {
    halves.direct_a.setZero(rows, unknowns);
    halves.direct_b.setZero(rows, unknowns);
  }
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    const UnknownRow& row = problem.layout.rows[static_cast<std::size_t>(k)];
    const SlotFilm& slot = film.slots[static_cast<std::size_t>(row.slot)];
    halves.differentiated[k] = !slot.mean.empty();
    if (!has_gain && !photo.align) halves.channel[k] = row.channel;  // both mix channels
    if (!halves.differentiated[k]) continue;
    const float scale = static_cast<float>(slope[k]);
    set_column(halves.jacobian_a, k, as_vector(slot.half_a), row.channel, scale);
    set_column(halves.jacobian_b, k, odd_half(film, slot.mean, slot.half_a), row.channel, scale);
    if (alignment) {
      alignment->eliminate(halves.jacobian_a.col(k));
      alignment->eliminate(halves.jacobian_b.col(k));
    }
    if (!slot.direct.empty()) {
      set_column(halves.direct_a, k, as_vector(slot.direct_half_a), row.channel, scale);
      set_column(halves.direct_b, k, odd_half(film, slot.direct, slot.direct_half_a), row.channel,
                 scale);
      const std::array<std::pair<Jacobian*, const Eigen::VectorXf*>, 2> parts{
          {{&halves.direct_a, &picture_a}, {&halves.direct_b, &picture_b}}};
      for (const auto& [part, picture] : parts) {
        if (alignment) alignment->eliminate(part->col(k));
        if (gain)
          gain->eliminate(*picture, halves.variance, no_covariance, row.channel, part->col(k));
      }
    }
    if (!gain) continue;
    const Eigen::VectorXf covariance = as_vector(slot.covariance) * (2 * scale);
    gain->eliminate(picture_a, halves.variance, covariance, row.channel, halves.jacobian_a.col(k));
    gain->eliminate(picture_b, halves.variance, covariance, row.channel, halves.jacobian_b.col(k));
  }
  return halves;
}

}  // namespace selenite
