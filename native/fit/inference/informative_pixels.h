// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "InformativePixelsOptions".
struct InformativePixelsOptions {
  /// One of so many pixels with a positive score is selected. On the dragon of the thesis a third of
  /// what photos know of the IOR lies there, and little more in twice as many.
  int one_of = 48;
  /// Of their equations, whose noise is a twentieth of that of others. It is less than half of what that
  /// permits, as model errors lie there, too.
  float weight = 8;
};
inline constexpr InformativePixelsOptions kInformativePixels;

/// Few pixels, rendered with many samples: those that say most about the unknowns.
///
/// Where a lamp is seen refracted, some pixels know more of the IOR than all others together. But the
/// derivatives have noise in every pixel, and few samples of all pixels hide those. The same samples in a
/// hundredth of the pixels are a hundred times as many there. Other samples than those that are taken
/// there select the pixels, so that the choice leaves no bias.
class InformativePixels {
 public:
  /// `problem` must outlive it.
  explicit InformativePixels(const Problem& problem,
                             const InformativePixelsOptions& options = kInformativePixels)
      : problem_(&problem), options_(options), pilot_(problem.photos.size()) {}

  /// Derivatives of a whole photo join the pilot pass, which selects. `weight` as of
  /// `InstrumentalVariables`, `slope` as of `split_halves`.
  void add_pilot(const Observation& derivatives, const Vector& slope, double weight);
  /// Selects anew, in the weights of `gauss_newton`, and forgets what was gathered. `counts`: by unknown,
  /// whether it takes part.
  void choose(const GaussNewton& gauss_newton, const std::vector<bool>& counts);
  bool empty() const { return selections_.empty(); }
  /// Photo i with its selected pixels alone.
  const Photo& photo(std::size_t i) const { return selections_[i].photo; }

  /// Derivatives of such a photo join its sums.
  void gather(const Observation& derivatives, const Vector& slope);
  /// What photo i says; `residual` is a render of its own with other seeds. Other pixels say nothing.
  GaussNewton::WeightedResidual seen(std::size_t i, const Film& residual,
                                     const GaussNewton& gauss_newton) const;
  /// Gives the equations of the informative pixels of all photos more weight than those of whole photos,
  /// as far as their instruments are no noise.
  void weigh(std::vector<GaussNewton::PhotoEquations>& all) const;

  void members(SavedState& state);

 private:
  struct Selection {
    Photo photo;
    InstrumentalVariables jacobians;
    Eigen::VectorXf variance{};  ///< of one sample, summed over what was gathered
    int gathered = 0;
  };

  const Problem* problem_;
  InformativePixelsOptions options_;
  std::vector<InstrumentalVariables> pilot_;
  std::vector<Selection> selections_;  ///< empty: no pixel says anything
};

}  // namespace selenite
