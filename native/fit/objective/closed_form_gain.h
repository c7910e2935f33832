// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "fit/problem/photo.h"
#include "render/film/film.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "GainPriorOptions".
struct GainPriorOptions {
  double log_deviation = 0.7;  ///< standard deviation of log gain before any photo: a factor of two
  int blocks = 10;             ///< along the longer side of a photo
  int steps = 30;              ///< of Newton's method, at most
};
inline constexpr GainPriorOptions kGainPrior;

/// The gain with which a render comes nearest to a photo, as `Photo::gain_freedom` allows: it maximises
/// the likelihood of the photo times the prior. 1 where the render is black or nothing is free. `film`
/// has no gain yet; `weights`: precisions of the residuals times their shares, which sum to 1.
Colorf closed_form_gain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights);

/// Of the prior, in units of the weighted squares of the picture.
double gain_prior_strength(const Photo& photo);

/// Standard error of such a gain, the other values given, by how blocks of pixels scatter: neighbours
/// share what no gain explains. `film` has the gain.
Colorf gain_error(const Film& film, const Colorf& gain, const Photo& photo,
                  const Eigen::VectorXf& weights);

/// One half of a film, as rows of a Jacobian are: 3 numbers a pixel.
struct HalfPicture {
  const Eigen::VectorXf& mean;      ///< with its gain
  const Eigen::VectorXf& variance;  ///< of it
};

/// Takes from a column of derivatives what a change of the gain makes of the picture, so that the
/// normal equations are those with the gain eliminated. `covariance` of picture and derivative; channel:
/// of the column, below 0 all.
void eliminate_gain(const HalfPicture& half, const Photo& photo, const Eigen::VectorXf& weights,
                    const Eigen::VectorXf& covariance, int channel,
                    Eigen::Ref<Eigen::VectorXf> column);

}  // namespace selenite
