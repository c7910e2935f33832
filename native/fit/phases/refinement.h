// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/phases/absent_weights.h"
#include "fit/phases/refined_point.h"

namespace selenite {

struct RefinementOptions {
  int most_passes = 4;
  /// Intervals that suffice, see `samples_factors`; 0: as narrow as the samples make them.
  double precision = 0;
  /// Samples beyond those that a precision needs by the last pass, whose interval is noisy itself.
  double margin = 1.2;
  /// What all samples would leave wider than asked by the root of this is given up. Less is a reason to
  /// go on: the interval is far narrower than that of few samples, and instruments become better too.
  double hope = 16;
  double converged_sigmas =
      kCertainSigmas;  ///< a longer step, in standard deviations: x was not there yet
  /// Share of the longest step within which a linear step is as good as a pass at its end.
  double near = kLinearShare;
  int least_of_pass = 32;  ///< samples: with fewer there is nothing to step by
  int offset_share = 4;    ///< of a pass at an offset, which gathers its own instruments
  /// Of the samples of residuals. With an eighth, intervals are too narrow where unknowns nearly make up
  /// for each other. Measured: docs/measurements/intervals.md.
  int derivative_share = 4;
  int warm_ups = 2;  ///< pictures that gather instruments where the fit has none
};

/// Refinement passes at fixed values: renders the photos with fresh seeds at the values that a fit has
/// found, steps, and reports how sure they are.
///
/// Where the step is more than noise the pass is repeated from its end, and if the last one still is, its
/// length is an error beside the noise. If a precision is asked for, passes take the samples that it
/// needs by the pass before, and the one that has it is the last. The first passes take few samples: they are the way to where the
/// next one begins, and where the last step is mostly their noise it is weighed against them by the
/// samples of both. A value that may be known badly because its slope vanishes near there is expanded at
/// an offset (offset_expansion.h), and where that leads elsewhere there is one more pass.
class Refinement {
 public:
  /// `problem` must outlive it. Takes instruments from `optimiser`; null: it gathers its own. `fields` are
  /// those at which the photos are rendered.
  Refinement(const Problem& problem, std::unique_ptr<GaussNewton> optimiser, Point point,
             std::uint64_t seed, int spp, int iteration_spp, RefinementOptions options = {});

  /// These stay at 0; before the first step.
  void hold(const std::vector<AbsentWeight>& absent);
  /// See `Optimiser`.
  void watch(const Progress* progress) { point_.gauss_newton.watch(progress); }
  /// The next photo of a pass; false when it was the last of the last. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  double fraction() const;
  const Vector& values() const { return point_.x; }
  /// See `RefinedPoint::accept`.
  void accept(const Vector& x) { point_.accept(x); }
  const TrustReport& report() const { return point_.report; }
  /// Of the residuals of each photo, by what was seen of their noise.
  std::vector<Eigen::VectorXf> weights() const;
  void members(SavedState& state);

 private:
  Observation derivatives(Evaluator& evaluator, int purpose, int portion, int spp,
                          std::size_t index) const;
  Evaluation of_derivatives(int purpose, int portion, int spp, std::size_t photo) const;
  Evaluation of_residual(int spp, std::size_t photo) const;
  int portion_spp(int spp) const;
  /// Whether this pass takes derivatives.
  bool gathers() const;
  void expect(Evaluator& evaluator, int spp);
  void gather_first_jacobians(Evaluator& evaluator);
  /// The derivatives of this photo that go with residuals of `spp` samples.
  void gather(Evaluator& evaluator, int spp);
  void end_pass();
  /// Goes on with a pass at the offset x, which gathers instruments of its own.
  void expand_at_offset(const Vector& x);
  void end_offset();
  /// One more pass, from where the offset has led.
  void refine_after_offset();
  int purpose() const;
  /// Of those to come where no precision is asked for.
  int pass_spp(int pass) const;
  /// By what factor the samples of a pass must grow until its intervals are as narrow as asked; those
  /// that no pass would bring there do not count. Infinite: all samples are wanted.
  double wanted_samples(const Estimate& now) const;
  double noise_of_step() const;

  /// What belongs to the answer, while a pass is taken at an offset from it.
  struct Suspended {
    GaussNewton gauss_newton;
    NormalEquations equations;
    Vector u, x;
    void members(SavedState& state) { state(gauss_newton, equations, u, x); }
  };

  RefinementOptions options_;
  bool has_jacobians_;
  RefinedPoint point_;
  FieldValues fields_;
  std::size_t photo_ = 0;  ///< the next of this pass
  Ahead ahead_;            ///< likewise
  std::uint64_t seed_;
  int spp_, iteration_spp_;
  std::vector<int> spps_{};  ///< of the passes that have begun
  bool over_ = false;
  std::optional<Suspended> suspended_;
  bool after_offset_ = false;  ///< this pass begins where one at an offset has led
};

}  // namespace selenite
