// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/photo/photo.h"
#include "fit/problem/significance.h"

namespace selenite {

// Columns hold the channels of pixels, three numbers a pixel.

/// Sources: docs/measurements/constants.md, "PixelWeightsOptions".
struct PixelWeightsOptions {
  double dim_share = 0.3;  ///< of the photo's mean, added to a pixel's brightness
  /// The same where Adam steps fields by the samples of one iteration: noise of dark pixels would move
  /// them.
  double dim_share_of_fields = 3;
  int radius = 2;             ///< of the neighbourhood whose brightness counts
  double black = 1e-6;        ///< least mean by which a photo is judged: weights stay finite
  int noise_radius = 2;       ///< of the mean over the noise of neighbours
  double final_samples = 64;  ///< samples that a pixel has seen in the end
  double model_error = 0.05;  ///< of a pixel's brightness, at least
  /// Iteration at which Gauss-Newton first puts the noise into its weights; it doubles each time.
  int first_weighing = 3;
  /// The model error that residuals show joins at the answer, and only if neighbouring pixels share it
  /// beyond so many standard errors: before, residuals are mostly those of values that are still on
  /// their way, and where the model explains the photos weights are those of noise. A plain one, as a
  /// share of brightness, joins at once: by relative weights dark pixels would rule.
  double model_error_sigmas = kCertainSigmas;
  double plain_model_error = 0.2;
};
inline constexpr PixelWeightsOptions kPixelWeights;

/// Mean over the photo's weighted pixels and channels; what is below 0 counts as black.
double mean_brightness(const Photo& photo);

/// Brightness of the photo around each pixel, kept away from 0. The pixel itself is left out: else
/// weights would follow the noise of the photo, and weighted residuals would be biased.
Eigen::VectorXf brightness(const Photo& photo, const PixelWeightsOptions& options = kPixelWeights);

/// Each number's share in the mean over all of `photos` photos.
Eigen::VectorXf shares(const Photo& photo, std::size_t photos);

/// The shares over the squared brightness: a weighted sum of squared residuals is their mean square
/// relative to the photo.
Eigen::VectorXf relative_weights(const Photo& photo, std::size_t photos,
                                 const PixelWeightsOptions& options = kPixelWeights);

/// Variance of a residual: that of the render in the end, and the least model error. `variance`: of one
/// sample, 3 numbers a pixel.
Eigen::VectorXf residual_variance(const Photo& photo, const Eigen::VectorXf& variance,
                                  const PixelWeightsOptions& options = kPixelWeights);

/// The shares over the variance of a residual: that of the render in the end, and a model error.
/// `variance`: of one sample, 3 numbers a pixel.
Eigen::VectorXf noise_weights(const Photo& photo, std::size_t photos,
                              const Eigen::VectorXf& variance,
                              const PixelWeightsOptions& options = kPixelWeights);

/// Mean around each pixel over those of the square of 2 `radius` + 1 that count, without that pixel
/// itself, and without the 8 beside it if they share pixels of the file with it; its own value where
/// there is no other.
Eigen::VectorXf mean_around(const Eigen::VectorXf& column, const Photo& photo, int radius);

/// Mean over squares of 2 `radius` + 1 pixels, within the picture, which has one or three numbers a
/// pixel.
Eigen::VectorXf box_blur(const Eigen::VectorXf& column, int width, int height, int radius);

}  // namespace selenite
