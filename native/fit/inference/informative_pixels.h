// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Few pixels, looked at with many samples: those that tell most about the unknowns.
///
/// Where a lamp is seen refracted, some pixels know more of the IOR than all others together; but the
/// derivatives have noise in every pixel, and few samples of all drown those. The same samples in a
/// hundredth of the pixels are a hundred times as many there. Which pixels they are is chosen by other
/// samples than those that are taken there, so that the choice leaves no bias.
class Focus {
 public:
  /// `problem` must outlive it.
  explicit Focus(const Problem& problem) : problem_(&problem), scouted_(problem.captures.size()) {}

  /// Derivatives of a whole photo, which tell where to look; `weight` as of `JacobianSums`, `slope` as
  /// of `split_halves`.
  void scout(const Observation& derivatives, const Vector& slope, double weight);
  /// Chooses anew, in the weights of `evidence`, and forgets what was seen. `counts`: by unknown,
  /// whether it is to be looked for.
  void choose(const GaussNewton& evidence, const std::vector<bool>& counts);
  bool empty() const { return photos_.empty(); }
  /// Photo i with its chosen pixels alone.
  const Capture& photo(std::size_t i) const { return photos_[i].capture; }

  /// Derivatives of such a photo join its sums.
  void gather(const Observation& derivatives, const Vector& slope);
  /// Of photo i; `residual`: a render of its own with other seeds. Other pixels say nothing.
  GaussNewton::Seen seen(std::size_t i, const Film& residual, const GaussNewton& evidence) const;
  /// Gives the equations of what was seen, all photos', their weight beside those of the whole photos:
  /// more, as far as their instruments are no noise.
  static void weigh(std::vector<GaussNewton::Equations>& all);

 private:
  struct Photo {
    Capture capture;
    JacobianSums jacobians;
    Eigen::VectorXf variance{};  ///< of one sample, summed over what was gathered
    int gathered = 0;
  };

  const Problem* problem_;
  std::vector<JacobianSums> scouted_;
  std::vector<Photo> photos_;  ///< empty: no pixel tells
};

}  // namespace selenite
