// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/evaluate/validation.h"
#include "fit/state/fit_result.h"

namespace selenite {

/// Which of the points that a fit has validated it returns: `FitResult::best`.
class BestIterate {
 public:
  /// prefers_low_roughness: of two that explain the photos about as well, the one of low roughness.
  BestIterate(const Unknowns& unknowns, bool prefers_low_roughness)
      : unknowns_(&unknowns), prefers_low_roughness_(prefers_low_roughness) {}

  /// Writes the validation into `row`, and the row into `result` as the best if it is. The fields that
  /// belong to it are `result.fields_last`.
  void note(HistoryRow& row, const Validation& validation, FitResult& result);
  /// The values that the user gave, and their validation: what a fit returns must not be worse.
  void note_start(const Validation& validation) { start_ = validation; }
  bool has_start() const { return !start_.parts.empty(); }
  const Validation& start() const { return start_; }
  void keep_start() { best_ = start_; }
  /// Judges anew what it knows, by weights that have been learned.
  void reweigh(const FitProblem& problem, FitResult& result);
  const Validation& validation() const { return best_; }
  /// Whether the best values so far are of low roughness and these are not: they may have to yield.
  bool may_yield(const Vector& x, const FitResult& result) const;
  /// Whether they do, as they explain the photos no better.
  bool yields(const Vector& x, const Validation& validation, const FitResult& result) const;
  void members(SavedState& state) { state(smallest_, best_, start_); }

 private:
  const Unknowns* unknowns_;
  bool prefers_low_roughness_;
  Validation smallest_, best_, start_;  ///< without parts: none yet
};

}  // namespace selenite
