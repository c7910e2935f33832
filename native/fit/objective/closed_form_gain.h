// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

#include "fit/photo/photo.h"
#include "render/film/film.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "GainPriorOptions".
struct GainPriorOptions {
  double log_deviation = 0.7;  ///< standard deviation of log gain before any photo: a factor of two
  int blocks = 10;             ///< along the longer side of a photo
  int steps = 30;              ///< of Newton's method, at most
  double least_size = 1e-3;    ///< of the prior's row beside the picture: less is rounding
};
inline constexpr GainPriorOptions kGainPrior;

/// Numbers of a photo that count: the sum of weighted squares times this is a chi-square.
double count_of(const Photo& photo);

/// Of the prior, in units of the weighted squares of the picture. `count`: independent residuals.
inline double gain_prior_strength(double count) {
  return 1 / (kGainPrior.log_deviation * kGainPrior.log_deviation * count);
}

/// As the equations hold it beside a picture of that strength.
inline double prior_in_equations(double prior, double strength) {
  return std::max(prior, kGainPrior.least_size * kGainPrior.least_size * strength);
}

/// The gain with which a render comes nearest to a photo, as `Photo::gain_freedom` allows: it maximises
/// the likelihood of the photo times the prior. 1 where the render is black or nothing is free. `film`
/// has no gain yet; `weights`: precisions of the residuals times their shares, which sum to 1; `prior`:
/// its strength.
Colorf closed_form_gain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
                        double prior);

/// How many independent residuals a photo has: as many as make its blocks scatter as they do. `residual`
/// without noise, 3 numbers a pixel; `weights` as above. At most `count_of`.
double independent_count(const Photo& photo, const Eigen::VectorXf& weights,
                         const Eigen::VectorXf& residual);

/// Standard error of such a gain, the other values given, by how blocks of pixels scatter: neighbours
/// share what no gain explains. `film` has the gain.
Colorf gain_error(const Film& film, const Colorf& gain, const Photo& photo,
                  const Eigen::VectorXf& weights);

/// A photo's free gain as its picture shows it, eliminated from the equations.
///
/// What a change of the gain makes of the picture is no longer seen in derivatives, but for the prior: it
/// is a row of its own in the equations. It stands where the picture's own direction was, with the size
/// that the prior has, so that sums over pixels hold it.
class EliminatedGain {
 public:
  /// `film` has the gain, by which it minimises the weighted squares and the prior.
  EliminatedGain(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
                 double prior);
  /// Takes the gain's part from a column of derivatives of one half of the film. `covariance` of picture
  /// and derivative; channel: of the column, below 0 all.
  void eliminate(const Eigen::VectorXf& mean, const Eigen::VectorXf& variance,
                 const Eigen::VectorXf& covariance, int channel,
                 Eigen::Ref<Eigen::VectorXf> column) const;
  /// Puts the distance from the prior into the residuals of one half, `mean` its picture.
  void add_prior(const Eigen::VectorXf& mean, Eigen::Ref<Eigen::VectorXf> residual) const;

 private:
  double size(std::size_t channel) const;

  bool scalar_;
  double prior_;
  const Eigen::VectorXf& weights_;
  std::array<double, 3> strength_{}, slope_{};  ///< picture times picture, times residual
};

}  // namespace selenite
