// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/low_roughness_restart.h"

#include <algorithm>

#include "fit/state/low_roughness.h"

namespace selenite {

bool LowRoughnessRestart::begin(const FitRun& run, bool first) {
  const Unknowns& unknowns = run.problem.unknowns();
  const Vector& x = run.point.scalars;
  const bool low = is_low_roughness(unknowns, x);
  if (!run.strategy.prefers_low_roughness() || found_ || (first && !ior_.enabled())) return false;
  if (low && ior_.components(x).empty()) return false;
  candidates_.push_back({x, {}});
  if (!low) candidates_.push_back({at_low_roughness(unknowns, x), {}});
  return true;
}

bool LowRoughnessRestart::step(FitRun& run) {
  Candidate& next = *std::ranges::find_if(
      candidates_, [](const Candidate& one) { return one.validation.parts.empty(); });
  next.x = ior_.apply(next.x, run);
  next.validation = run.validate({next.x, run.point.fields});
  if (candidates_.back().validation.parts.empty()) return true;
  moved_ = candidates_.size() > 1 &&
           explains_as_well(candidates_.back().validation, candidates_.front().validation);
  Candidate& best = moved_ ? candidates_.back() : candidates_.front();
  run.point.scalars = run.result.last = best.x;
  found_ = std::move(best.validation);
  candidates_.clear();
  return false;
}

void LowRoughnessRestart::members(SavedState& state) { state(candidates_, found_, moved_); }

}  // namespace selenite
