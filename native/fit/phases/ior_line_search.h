// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/state/phase.h"

namespace selenite {

struct IorLineSearchOptions {
  /// In log(IOR - 1): 0.02 at 1.5, where lamps that are seen through a sharp body move by about a pixel
  /// of a hundred.
  double step = 0.04;
};

/// Finds the IOR of what refracts sharply by the loss itself, by a parabola through three points.
///
/// Lamps that are seen through a body are at other pixels with another IOR: few iterations of derivatives
/// tell little of it, but the loss rises on both sides, whatever the texels are.
class IorLineSearch {
 public:
  explicit IorLineSearch(const FitRun& run, IorLineSearchOptions options = {})
      : problem_(&run.problem), enabled_(run.strategy.searches_ior()), options_(options) {}

  bool enabled() const { return enabled_; }
  /// The components of x that are found so.
  std::vector<int> components(const Vector& x) const;
  /// x with those where they suit the photos best; the fields are those of `run.point`.
  Vector apply(Vector x, FitRun& run) const;

 private:
  const FitProblem* problem_;
  bool enabled_;
  IorLineSearchOptions options_;
};

}  // namespace selenite
