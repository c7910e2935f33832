// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "fit/state/best_iterate.h"
#include "fit/state/render_plan.h"
#include "fit/state/strategy.h"

namespace selenite {

/// What the phases of a fit share: the problem, the one evaluator, and where the fit stands.
struct FitRun {
  FitRun(const FitProblem& problem, const Strategy& strategy);
  FitRun(const FitRun&) = delete;  // the evaluator refers to `result`
  FitRun& operator=(const FitRun&) = delete;

  const FitProblem& problem;
  const Strategy& strategy;
  Point point;  ///< current values
  FitResult result;
  BestIterate best;
  Previews previews;
  PhotoEvaluator evaluator;

  Validation validate(const Point& at, int spp);
  Validation validate(const Point& at) {
    return validate(at, problem.settings().chosen_validation_spp());
  }
  /// Judges anew by weights that have changed, if they have.
  void follow_weights();
  /// A row of the history for a point, without losses.
  HistoryRow row(const Point& at) const;
  /// Moves to x, whose validation that is, as the final state so far. `confirmed`: more samples than a
  /// validation's say that it is the best. True where it became the best.
  bool accept(const Vector& x, const Validation& validation, bool confirmed = false);
  /// What fields explain of the residuals, by a validation of each with one value at all places.
  void explain_fields();
  /// Ends the fit; returns false.
  bool stop(StopReason reason, std::string message = {});
  /// Ends the fit where too many samples were not finite.
  bool stop_if_dropped();

  void members(SavedState& state);

 private:
  /// Returns the start where all that was found is worse by more than noise; the intervals then reach
  /// there.
  void keep_start_if_best();
  /// Of the best values; errors of gains know those of the values.
  void report_photos();

  int weights_version_ = 0;  ///< that validations are by
};

/// A phase of a fit. It owns its state and saves it: a fit can be resumed in the midst of any phase.
/// Beside what it does each kind has `static void plan(RenderPlan&)`, what that will render.
class Phase {
 public:
  virtual ~Phase() = default;
  virtual PhaseKind kind() const = 0;
  /// The next portion of the work; false when the phase is over or the fit has been stopped. After an
  /// exception (Cancelled, or an error) the phase is not continued.
  virtual bool step(FitRun& run) = 0;
  /// Called once where a step was cancelled: hands on what is best so far.
  virtual void end_early(FitRun&) {}
  /// Share of its work that is done.
  virtual double fraction() const = 0;
  virtual void members(SavedState& state) = 0;
};

}  // namespace selenite
