// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/problem/problem.h"
#include "fit/problem/saved_state.h"
#include "render/film/film.h"

namespace selenite {

/// One photo, rendered at the current values with fresh seeds.
struct Observation {
  int photo;
  Film film;  ///< `slots` are those of Problem::layout
  LossResult loss;
};

/// Rows: channels of pixels, as they lie in a Picture; columns: unknowns.
using Jacobian = Eigen::MatrixXf;

/// Independent halves of a film, in an optimiser's reparametrization.
struct Halves {
  Eigen::VectorXf residual_a, residual_b;  ///< half-buffer minus photo
  Eigen::VectorXf variance;                ///< of one half-buffer
  Jacobian jacobian_a, jacobian_b;
  /// By unknown: whether the film has a derivative by it, its columns being 0 otherwise.
  Eigen::ArrayX<bool> differentiated;
  /// By unknown: the only channel in which its columns differ from 0; -1, or empty: any.
  Eigen::ArrayXi channel;
  /// The direct share of the columns, 0 where it is not known apart; empty: of none.
  Jacobian direct_a, direct_b;
  void members(SavedState& state) {
    state(residual_a, residual_b, variance, jacobian_a, jacobian_b, differentiated, channel,
          direct_a, direct_b);
  }
};

/// Render minus photo, 3 numbers a pixel.
Eigen::VectorXf mean_residual(const Film& film, const Photo& photo);
/// Variance of the render.
Eigen::VectorXf mean_variance(const Film& film);
/// Without the Jacobians.
Halves residual_halves(const Film& film, const Photo& photo);
/// The same of photo i, with what the prior of its free gain adds.
Halves residual_halves(const Problem& problem, std::size_t i, const Film& film);
std::vector<Halves> residual_halves(const Problem& problem, std::span<const Observation> seen);
/// Which pixels of a photo a film has. The prior of a free gain is a row of the whole photo's equations.
enum class FilmExtent { kPhoto, kSomePixels };
/// `slope` is dx/du per unknown.
Halves split_halves(const Problem& problem, const Observation& seen, const Vector& slope,
                    FilmExtent extent = FilmExtent::kPhoto);

}  // namespace selenite
