// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/photo/photo.h"

namespace selenite {

class SavedState;

/// The square of residuals as far as neighbouring pixels share them, over all photos that were added: what
/// no noise explains. Noise of a photo or of a render is of one pixel.
struct SharedResidual {
  /// Weighted sum, and its variance where neighbours share nothing. A pair of neighbours counts as one
  /// number: both of its products have the same noise of the photo.
  double square = 0, variance = 0;
  double brightness = 0;  ///< the same sum of the photos' squared brightness

  /// Independent halves of the residuals and their weights, 3 numbers a pixel. A pixel's residual in one
  /// half is multiplied by that of its 8 neighbours in the other.
  void add(const Photo& photo, const Eigen::VectorXf& half_a, const Eigen::VectorXf& half_b,
           const Eigen::VectorXf& weights);
  /// In units of squared brightness.
  double relative() const { return brightness > 0 ? square / brightness : 0; }
  double relative_error() const;
  void members(SavedState& state);
};

}  // namespace selenite
