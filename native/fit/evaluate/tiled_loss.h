// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/problem/photo.h"
#include "fit/problem/saved_state.h"
#include "render/film/film.h"

namespace selenite {

/// How far a render is from a photo: the weighted sum of squared residuals, without the bias of
/// noise, tile by tile. Few samples know little of single pixels where light comes by rare bright
/// paths, but something of what pixels have in common.
struct TiledLoss {
  Eigen::ArrayXd coarse;  ///< of blurred residuals, one half of the samples times the other
  Eigen::ArrayXd all;     ///< of each pixel's own

  /// weights: of the residuals, 3 numbers a pixel.
  TiledLoss(const Film& film, const Photo& photo, const Eigen::VectorXf& weights);
  TiledLoss() = default;
  /// Another photo's tiles, `share` of all.
  void append(const TiledLoss& other, double share);
  void members(SavedState& state) { state(coarse, all); }
};

/// Sum of independent terms, and its standard deviation as their scatter tells it.
struct NoisySum {
  double sum, deviation;
  explicit NoisySum(const Eigen::ArrayXd& terms);
};

}  // namespace selenite
