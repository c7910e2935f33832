// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/photo/photo.h"
#include "fit/problem/saved_state.h"
#include "render/film/film.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "TiledLossOptions".
struct TiledLossOptions {
  double radius = 3.0 / 40;  ///< of the blur, as a share of the longer side of the picture
};

/// How far a render is from a photo: the weighted sum of squared residuals, without the bias of noise,
/// tile by tile. Where light comes by rare bright paths, few samples know little of single pixels, but
/// something of what pixels have in common.
struct TiledLoss {
  Eigen::ArrayXd coarse;  ///< of blurred residuals, one half of the samples times the other
  Eigen::ArrayXd all;     ///< of each pixel's own

  /// weights: of the residuals, 3 numbers a pixel.
  TiledLoss(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
            const TiledLossOptions& options = {});
  TiledLoss() = default;
  /// Another photo's tiles, `share` of all.
  void append(const TiledLoss& other, double share);
  void members(SavedState& state) { state(coarse, all); }
};

/// Sum of independent terms, and its standard deviation by their scatter.
struct NoisySum {
  double sum, deviation;
  explicit NoisySum(const Eigen::ArrayXd& terms);
};

}  // namespace selenite
