// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>

#include "fit/problem/photo.h"

namespace selenite {

/// Tells signal from noise in pictures of the same thing that are mostly noise: how much of each band
/// (detail between box roughnesses of growing size) is common to two independent ones, by place and
/// channel. A Wiener filter with measured spectra: sharp highlights stay sharp where they are seen,
/// smooth regions are averaged widely, and where nothing is seen yet nothing is left.
class WienerFilter {
 public:
  /// Pictures with three channels a pixel, row by row; `weight` of the same size: what a deviation
  /// counts.
  WienerFilter(const Eigen::VectorXf& a, const Eigen::VectorXf& b, const Eigen::VectorXf& weight,
            int width, int height);
  /// `noise`: variance of the picture's noise in units of that of `a`.
  Eigen::VectorXf filter(const Eigen::VectorXf& picture, float noise) const;

 private:
  static constexpr std::array kRadii{1, 2, 4};
  using Bands = std::array<Eigen::VectorXf, kRadii.size() + 1>;
  Bands split(const Eigen::VectorXf& picture) const;

  int width_, height_;
  Bands signal_, noise_;  ///< weighted variances around each pixel
};

/// A column cut at a quantile of its absolute values: single paths must not rule it.
Eigen::VectorXf clipped_derivative(const Eigen::VectorXf& column, const Photo& photo, int channel);

/// The mean of two independent draws of a picture of derivatives, or of a difference: clipped, filtered
/// by what the two have in common. `share`: variance of the mean's noise over the sum of theirs.
Eigen::VectorXf filtered_derivative(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                              const Eigen::VectorXf& other, double share, const Photo& photo,
                              int channel, const Eigen::VectorXf& importance);

}  // namespace selenite
