// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "fit/inference/confidence_intervals.h"
#include "fit/inference/photo_jacobian.h"
#include "fit/objective/residual_model.h"
#include "fit/photo/photo.h"
#include "fit/solver/instrumental_variables.h"

namespace selenite {

/// Of a photo's residual in the last pass of a fit.
struct ResidualNoise {
  double spp;       ///< samples of a pixel in the render that is compared with the photo
  double relative;  ///< error of the photo itself, a share of its brightness
  double pixels;    ///< so many pixels of the photo are one of the `PhotoJacobian`
  /// That a fit has found, its shift in pixels of the photo; neighbours share it.
  ModelError model{};
};

/// What one photo says about the unknowns, in `Reparametrization`; before there is a fit.
///
/// With J = d picture / d unknowns, w the weights of a fit (noise, and the model error) and V the variance of a
/// residual, each summed over pixels and channels. Z are the instruments of a fit: J clipped and
/// filtered. Their columns are scaled, which changes no estimate, so that Z^T w Z is as long as
/// Z^T w J. Source: docs/method/confidence.md, "Fisher information".
struct FisherInformation {
  Eigen::MatrixXd normal;           ///< Z^T w J without the bias of noise in J; not symmetric
  Eigen::MatrixXd normal_variance;  ///< of each of its entries
  /// Z^T w V w Z, the channels of a pixel varying together, as most noise of light does.
  Eigen::MatrixXd score_covariance;
  /// What the score's covariance can be in units of the normal matrix: w V with channels apart, and
  /// three times that.
  double low = 0, high = std::numeric_limits<double>::infinity();

  /// Of the information about the single components the largest error, as a share of it; infinite
  /// where there is none but noise.
  double relative_uncertainty() const;
  /// Inverse covariance of what a fit to the photo would find, positive semidefinite.
  ///
  /// Directions whose information is not more than `resolved` standard deviations of its own noise,
  /// a negative one among them, count as not seen. So another photo never makes anything less known.
  Eigen::MatrixXd precision(double resolved = kConfidence.resolved) const;
};

/// All portions, weighted by their samples.
InstrumentalVariables instrumental_variables(const PhotoJacobian& seen);

/// `photo`: of the size of `seen`, checked; a render in its place where there is none.
FisherInformation fisher_information(const PhotoJacobian& seen, const Photo& photo,
                                     const ResidualNoise& noise);

/// Of all directions the least information of the photos together, in standard deviations of its
/// noise; 0 where a component is not seen.
double weakest_direction(std::span<const FisherInformation> photos);

/// Standard error of each unknown, those of the others being unknown too, from the `precision` of
/// each photo. What no photo shows is as wide as its bounds, `ranges` apart, leave it.
Vector expected_errors(std::span<const Eigen::MatrixXd> photos, const Vector& ranges);
/// By component, as in a fit's report.
std::vector<bool> determined(const Vector& errors, const Vector& ranges);
/// Logarithm of the factor by which errors shrink, the mean over `groups`, the components of each
/// parameter: a colour counts as much as a number. 0: nothing is gained. It does not change with the
/// units of a parameter, and what becomes known at all counts most.
double information_gain(const Vector& before, const Vector& after,
                        const std::vector<std::vector<int>>& groups);

/// Mean square of what a photo differs by from a render beyond the render's noise, in units of its
/// brightness. Pixels count as in a fit, which hardly looks at the noisiest ones: else a few bright
/// paths would be all of it.
double relative_misfit(const Film& film, const Photo& photo);

}  // namespace selenite
