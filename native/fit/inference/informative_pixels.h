// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "InformativePixelsOptions".
struct InformativePixelsOptions {
  /// One of so many pixels that tell something is chosen. On the thesis' dragon a third of what photos
  /// know of the IOR lies there, and little more in twice as many.
  int one_of = 48;
  /// Of their equations, which have a twentieth of the noise of others: less than half of what that
  /// would be worth, as what the model is wrong about lies there, too.
  float weight = 8;
};
inline constexpr InformativePixelsOptions kInformativePixels;

/// Few pixels, looked at with many samples: those that tell most about the unknowns.
///
/// Where a lamp is seen refracted, some pixels know more of the IOR than all others together; but the
/// derivatives have noise in every pixel, and few samples of all drown those. The same samples in a
/// hundredth of the pixels are a hundred times as many there. Which pixels they are is chosen by other
/// samples than those that are taken there, so that the choice leaves no bias.
class InformativePixels {
 public:
  /// `problem` must outlive it.
  explicit InformativePixels(const Problem& problem) : problem_(&problem), pilot_(problem.photos.size()) {}

  /// Derivatives of a whole photo, which tell where to look; `weight` as of `InstrumentalVariables`, `slope` as
  /// of `split_halves`.
  void add_pilot(const Observation& derivatives, const Vector& slope, double weight);
  /// Chooses anew, in the weights of `gauss_newton`, and forgets what was seen. `counts`: by unknown,
  /// whether it is to be looked for.
  void choose(const GaussNewton& gauss_newton, const std::vector<bool>& counts);
  bool empty() const { return selections_.empty(); }
  /// Selection i with its chosen pixels alone.
  const Photo& photo(std::size_t i) const { return selections_[i].photo; }

  /// Derivatives of such a photo join its sums.
  void gather(const Observation& derivatives, const Vector& slope);
  /// Of photo i; `residual`: a render of its own with other seeds. Other pixels say nothing.
  GaussNewton::WeightedResidual seen(std::size_t i, const Film& residual, const GaussNewton& gauss_newton) const;
  /// Gives the equations of what was seen, all photos', their weight beside those of the whole photos:
  /// more, as far as their instruments are no noise.
  static void weigh(std::vector<GaussNewton::PhotoEquations>& all);

  void members(SavedState& state);

 private:
  struct Selection {
    Photo photo;
    InstrumentalVariables jacobians;
    Eigen::VectorXf variance{};  ///< of one sample, summed over what was gathered
    int gathered = 0;
  };

  const Problem* problem_;
  std::vector<InstrumentalVariables> pilot_;
  std::vector<Selection> selections_;  ///< empty: no pixel tells
};

}  // namespace selenite
