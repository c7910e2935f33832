// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"

namespace selenite {

/// The loss at a point by a render with fixed seeds and more samples than a step has: differences
/// between two points are not hidden by noise.
struct Validation {
  double loss = 0, unbiased = 0, variance = 0;
  std::vector<float> parts;  ///< of `unbiased`, pixel by pixel, all photos
  Color<double> bias;
  std::vector<Colorf> gains;  ///< free ones, of each photo
  std::vector<Alignment> alignments;
  /// What it is about, so that it can be judged anew.
  std::shared_ptr<const std::vector<Film>> films = std::make_shared<std::vector<Film>>();

  void members(SavedState& state);
};

/// What a fit says of one photo.
struct PhotoReport {
  Colorf gain{1, 1, 1};        ///< that the fit found; 1 where it is not free
  Colorf gain_error{0, 0, 0};  ///< its standard error; of a fit that computes intervals, theirs
                               ///< included
  Alignment alignment;
  double residual_rms = 0;  ///< root mean square of render minus photo, without the render's noise;
                            ///< 0 where that may be all of it
  double unexplained = 0;   ///< see `unexplained_share`
};

/// Newest picture of each photo, null before the first; never changed afterwards.
using Previews = std::vector<std::shared_ptr<const Picture>>;

/// The loss of renders of all photos, which have these gains, by the present weights.
Validation judge(const FitProblem& problem, std::shared_ptr<const std::vector<Film>> films,
                 std::vector<Colorf> gains);
/// `previews` takes the pictures. Throws what `evaluate` throws.
Validation validate(const FitProblem& problem, PhotoEvaluator& evaluator, const Point& point,
                    int spp, Previews& previews);

/// What a validation says of each photo; the errors of gains are those at the given values.
std::vector<PhotoReport> report_photos(const FitProblem& problem, const Validation& validation);

/// Whether `one` is worse by more than so many standard errors of the difference, pixel against pixel:
/// the seeds are the same, so most of the noise is common to both. Nothing is worse than an empty one.
bool is_worse(const Validation& one, const Validation& than, double sigmas);

}  // namespace selenite
