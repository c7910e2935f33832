// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/inference/confidence_intervals.h"
#include "fit/inference/photo_jacobian.h"
#include "fit/objective/gain_slopes.h"
#include "fit/problem/significance.h"
#include "fit/solver/gauss_newton.h"

namespace selenite {

/// Values, the normal equations of the photos there, and the Gauss-Newton step that follows from them.
/// All samples of a pass are for the same values, so its step and its covariance H^-1 Cov(g) H^-1 need
/// no assumption about the way that led there. Source: docs/method/confidence.md.
struct RefinedPoint {
  RefinedPoint(const Problem& problem, std::unique_ptr<GaussNewton> optimiser, Vector x);

  /// Begins a pass at the present values.
  void begin_pass();
  /// The step of the pass that has just been seen; notes what it says of the misfit.
  Estimate end_pass();
  Estimate estimate_here() const;
  /// What other passes say, with what is fixed.
  OtherPasses with_fixed(OtherPasses others) const;
  /// See `offset_point`, without what is fixed.
  std::optional<Vector> offset_of_free() const;
  /// `derivatives` of a photo at the present values join the instruments and the slopes of its gain;
  /// `weight`: their samples in units of those of an iteration.
  void gather(const Observation& derivatives, double weight);
  /// The longest component of a step, in units of those that may be taken at once.
  double reach_of(const Estimate& now) const;
  /// Moves along the step, as far as may be taken at once, and reports; returns the way in
  /// `Reparametrization`.
  Vector apply(const Estimate& now);
  /// `way`, in `Reparametrization`, is an error beside the noise of x.
  void widen(const Vector& way, const Vector& x);
  /// The answer is not `x` but this one, as what x was found by does not hold that far: how far they are
  /// apart is an error beside the noise.
  void accept(const Vector& accepted);
  /// What is known of x.
  void report_components(const Estimate& now, const Vector& x);
  const Reparametrization& reparametrization() const { return gauss_newton.reparametrization(); }
  bool is_roughness(int k) const;
  Vector ranges() const;
  void members(SavedState& state);

  const Problem* problem;
  GaussNewton gauss_newton;   ///< its instruments and weights; it takes no steps
  NormalEquations equations;  ///< of this pass so far
  Vector u;                   ///< of the last pass, in `Reparametrization`
  Vector x;
  GainSlopes gain_slopes;
  OtherPasses others;
  std::vector<std::optional<Known>> fixed;  ///< values that stay; empty: none
  TrustReport report;
};

inline constexpr int kLeastOfDerivatives = 2;  ///< samples: of two, each half has one

}  // namespace selenite
