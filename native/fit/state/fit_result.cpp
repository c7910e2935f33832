// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/fit_result.h"

namespace selenite {

const char* phase_text(PhaseKind phase) {
  switch (phase) {
    case PhaseKind::kMultiStart:
      return "multi-start";
    case PhaseKind::kDescent:
    case PhaseKind::kShape:
      return "descent";
    case PhaseKind::kRoughnessProfile:
      return "roughness-profile";
    case PhaseKind::kRefinement:
      return "refinement";
    case PhaseKind::kComparison:
      return "comparison";
    case PhaseKind::kParts:
      return "parts";
  }
  return "";
}

const char* stop_text(StopReason reason) {
  switch (reason) {
    case StopReason::kNone:
      return "";
    case StopReason::kIterations:
      return "all iterations done";
    case StopReason::kConverged:
      return "converged";
    case StopReason::kTolerance:
      return "loss below tolerance";
    case StopReason::kCancelled:
      return "cancelled";
    case StopReason::kDropped:
      return "too many samples were not finite";
    case StopReason::kError:
      return "error";
  }
  return "";
}

void FitResult::members(SavedState& state) {
  RenderCounts::members(state);
  const auto fields = [&](std::shared_ptr<const FieldValues>& shared) {
    FieldValues values;
    if (!state.reading()) values = *shared;
    state(values);
    if (state.reading()) shared = std::make_shared<const FieldValues>(std::move(values));
  };
  state(last, best, best_iteration, best_validation, best_validation_standard_error, photos,
        start_validation, model_error, kept_start, iterations, phase, phase_fraction, search,
        shape_steps, patterns, report, history);
  fields(fields_last);
  fields(fields_best);
}

}  // namespace selenite
