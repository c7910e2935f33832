// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "fit/problem/pixel_weights.h"

namespace selenite {

class SavedState;

/// Sources: docs/measurements/constants.md, "ResidualModelOptions".
struct ResidualModelOptions {
  double degrees_of_freedom = 4;  ///< of Student's t
  int sweeps = 12;                ///< of expectation and maximisation
  double most_shift = 1;          ///< pixels: farther off it is no misalignment
  int radius = 2;                 ///< of the neighbourhood by which a pixel is judged
  double count_of_photo = 16;     ///< independent residuals by which a photo is judged
};

/// Parts of the error that no values of the unknowns explain, as standard deviations.
struct ModelError {
  double relative = 0;  ///< share of a pixel's brightness
  double absolute = 0;  ///< share of the photo's mean brightness
  double shift = 0;     ///< pixels along the photo's gradient: misaligned edges
};

/// What is known of the residuals of one photo; 3 numbers a pixel.
struct PhotoResiduals {
  const Photo& photo;
  Eigen::VectorXf
      variance;  ///< beside the model error: noise of the render in the end, and the floor
  Eigen::VectorXf
      product;  ///< of independent halves of the residual: its square, without their noise
};

/// The squared sizes by which the parts of a model error count, per photo.
struct ErrorScales {
  Eigen::VectorXf relative, absolute, shift;
  explicit ErrorScales(const Photo& photo);
  Eigen::VectorXf variance(const ModelError& error) const;
};

/// Scale mixture of normal distributions with the variance `variance + model error`.
///
/// The errors are those of all photos together: maximum likelihood of Student's t by expectation and
/// maximisation, each step a non-negative least squares problem of three numbers. Where the model
/// explains the photos all three are 0. Source: Lange, Little, Taylor 1989, "Robust statistical modeling
/// using the t distribution"; docs/method/losses.md, "Robust".
class ResidualModel {
 public:
  ResidualModel() = default;
  explicit ResidualModel(std::span<const PhotoResiduals> photos,
                         const ResidualModelOptions& options = {});

  const ModelError& error() const { return error_; }
  /// The error as a share of brightness: root of the mean of its variance over squared brightness.
  double size(std::span<const PhotoResiduals> photos) const;
  /// The weight of a normal residual times what its neighbourhood and its photo leave of it: 1 / variance,
  /// 3 numbers a pixel. The pixel itself does not count, or noise of the photo would be weighed by its size.
  /// p: the photo's number.
  Eigen::VectorXf precision(const PhotoResiduals& photo, std::size_t p) const;
  void members(SavedState& state);

 private:
  /// Of a photo's residuals, 3 numbers a pixel.
  struct Weighing {
    Eigen::VectorXf variance, tail;
  };
  Weighing weighing(const PhotoResiduals& photo, const ErrorScales& scales) const;
  Eigen::VectorXf tail(const PhotoResiduals& photo, const Eigen::VectorXf& variance) const;
  void weigh_photos(std::span<const PhotoResiduals> photos, std::span<const Weighing> weighings);

  ResidualModelOptions options_;
  ModelError error_;
  std::vector<double> of_photos_;  ///< what a photo's residuals leave of its weights; mean 1
};

}  // namespace selenite
