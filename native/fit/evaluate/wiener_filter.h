// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <tuple>

#include "fit/photo/photo.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "WienerFilterOptions".
struct WienerFilterOptions {
  std::array<int, 3> radii{1, 2, 4};  ///< of the box blurs between the bands, in pixels
  int window_radius = 4;              ///< of the window that variances are averaged over, in pixels
  /// Subtracted from the power that two pictures have in common: what chance gives, as of a single
  /// bright pixel.
  double standard_errors = 1;
  double clip_quantile =
      0.998;            ///< of the absolute values of a derivative picture, where it is cut
  int clip_stride = 5;  ///< every so many numbers make the quantile, which need not be exact
};

/// Separates signal from noise in pictures of the same thing that are mostly noise. Of each band (detail
/// between box blurs of growing radius) it keeps what two independent pictures have in common, by place
/// and channel. It is a Wiener filter with measured spectra: highlights stay sharp where they are seen,
/// smooth regions are averaged widely, and nothing is left where nothing is seen yet.
class WienerFilter {
 public:
  /// Pictures with one or three channels a pixel, row by row; `weight` of the same size: what a
  /// deviation counts.
  WienerFilter(const Eigen::VectorXf& a, const Eigen::VectorXf& b, const Eigen::VectorXf& weight,
               int width, int height, const WienerFilterOptions& options = {});
  /// `noise`: variance of the picture's noise in units of that of `a`.
  Eigen::VectorXf filter(const Eigen::VectorXf& picture, float noise) const;

 private:
  static constexpr std::size_t kBlurs = std::tuple_size_v<decltype(WienerFilterOptions::radii)>;
  using Bands = std::array<Eigen::VectorXf, kBlurs + 1>;
  Bands split(const Eigen::VectorXf& picture) const;

  int width_, height_;
  WienerFilterOptions options_;
  Bands signal_, noise_;  ///< weighted variances around each pixel
};

/// A derivative picture cut at a quantile of its absolute values: single paths must not dominate it.
Eigen::VectorXf clipped_derivative(const Eigen::VectorXf& column, const Photo& photo, int channel,
                                   const WienerFilterOptions& options = {});

/// The mean of two independent draws of a picture of derivatives, or of a difference, clipped and
/// filtered by what the two have in common. `share`: variance of the mean's noise over the sum of
/// theirs. `channel`: the only one that they have, below 0 for all.
Eigen::VectorXf filtered_derivative(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                                    const Eigen::VectorXf& other, double share, const Photo& photo,
                                    int channel, const Eigen::VectorXf& importance,
                                    const WienerFilterOptions& options = {});

}  // namespace selenite
