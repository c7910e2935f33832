// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fit/phases/phases.h"
#include "fit/shape/shape_descent.h"
#include "math/fault.h"

namespace selenite {

/// Fits unknowns of a scene to photos, step by step in the caller's thread: multi-start, descent,
/// refinement, and comparison with alternative minima, as the strategy asks. Results depend on the seed
/// only, not on the number of threads.
class Fit {
 public:
  /// Checks everything and reports all problems at once, one line each: InvalidArgument, or UnknownName
  /// when names that do not exist are the only problem.
  Fit(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
      FitSettings settings);

  /// What the phases of a fit will render.
  static std::vector<PlannedRenders> plan(const FitProblem& problem, const Strategy& strategy);

  /// A portion of a phase, in the descent one iteration. False when the fit is over. A cancelled step
  /// leaves values and history as they were before it and ends the fit.
  bool step(Progress* progress = nullptr);
  /// The whole state: a fit with the same arguments that is restored from it takes the same steps to the
  /// last bit. Between two steps, in any phase.
  std::string saved();
  /// The same within another state.
  void members(SavedState& state);
  /// Before the first step. InvalidArgument when it is damaged or of a fit with other arguments.
  void restore(std::string_view saved);
  /// After `restore`: of a fit that had ended.
  void restore_end(StopReason reason) { run_.result.stopped = reason; }
  /// So far; complete once `step` has returned false.
  const FitResult& result() const { return run_.result; }
  /// Why it failed; empty if it did not.
  const std::vector<Fault>& faults() const { return faults_; }

  const Vector& values() const { return run_.point.scalars; }
  const std::shared_ptr<const FitProblem>& problem() const { return shared_; }
  const Unknowns& unknowns() const { return problem_.unknowns(); }
  const Fields& fields() const { return problem_.fields(); }
  const std::vector<Photo>& photos() const { return problem_.photos(); }
  const FitSettings& settings() const { return problem_.settings(); }
  /// Iterations of the descent at most.
  int all_iterations() const { return strategy_.most_iterations(problem_); }
  /// As many as are planned, or at most once `done` are beyond these.
  int shown_iterations(int done) const {
    const int planned = strategy_.blocks(problem_).iterations();
    return done <= planned ? planned : all_iterations();
  }
  const Strategy& strategy() const { return strategy_; }
  /// Newest picture of each photo; empty before the first. Shared, never changed afterwards.
  const Previews& previews() const { return run_.previews; }

 private:
  std::unique_ptr<Phase> first_phase();
  void enter(std::unique_ptr<Phase> phase);
  /// The phase after the present one; null where the fit is over, with the reason in the result.
  std::unique_ptr<Phase> next_phase();
  std::unique_ptr<Phase> refinement_of_best(Descent& descent);
  std::unique_ptr<Phase> phase_to_restore(PhaseKind kind);

  Fit(std::shared_ptr<FitProblem> problem);

  std::shared_ptr<const FitProblem> shared_;  ///< constant from the first step on
  FitProblem& problem_;
  Strategy strategy_;
  FitRun run_;
  AlternativeMinima minima_;
  std::unique_ptr<Phase> phase_;
  std::vector<Fault> faults_;
  bool begun_ = false;
};

}  // namespace selenite
