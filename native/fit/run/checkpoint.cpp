// SPDX-License-Identifier: GPL-3.0-or-later
// How a fit is saved and resumed.
#include "fit/problem/saved_state.h"
#include "fit/run/fit.h"
#include "math/fault.h"

namespace selenite {
namespace {

constexpr const char* kFormat = "20 ";  ///< of the saved state: a new number for every change

}  // namespace

void Fit::members(SavedState& state) {
  const std::string mine =
      kFormat + std::string(strategy_.optimiser.name) + " " + problem_.fingerprint();
  std::string print = mine;
  state(print);
  if (print != mine)
    throw Refused("", "The saved state belongs to a fit of other settings, unknowns or photos",
                  "start without it");
  PhaseKind kind = phase_->kind();
  state(kind, run_, minima_);
  if (state.reading()) phase_ = phase_to_restore(kind);
  phase_->members(state);
}

/// A phase whose state is about to be read.
std::unique_ptr<Phase> Fit::phase_to_restore(PhaseKind kind) {
  const Problem& scalars = problem_.scalars();
  switch (kind) {
    case PhaseKind::kMultiStart:
      return std::make_unique<MultiStartPhase>(run_, minima_);
    case PhaseKind::kDescent:
      return std::make_unique<Descent>(run_);
    case PhaseKind::kShape:
      return std::make_unique<ShapeDescent>(run_);
    case PhaseKind::kParts:
      return std::make_unique<PartsPhase>(run_);
    case PhaseKind::kRoughnessProfile:
      return std::make_unique<RoughnessProfile>(run_);
    case PhaseKind::kRefinement:
      if (strategy_.joint)
        return std::make_unique<FieldRefinementPhase>(
            run_,
            *FieldGaussNewton::of(problem_.fields(), problem_.photos(),
                                  FieldGaussNewtonOptions::of(problem_.settings())),
            nullptr);
      return std::make_unique<RefinementPhase>(run_, minima_, Alternative{run_.point.scalars},
                                               nullptr);
    case PhaseKind::kComparison:
      return std::make_unique<ComparisonPhase>(
          std::make_unique<MinimaComparison>(scalars, std::vector<Eigen::VectorXf>(), run_.point,
                                             std::vector<Vector>(), 0, 1),
          minima_);
  }
  throw Refused("", "The saved state is of another version", "start without it");
}

std::string Fit::saved() {
  SavedState state;
  members(state);
  return state.sealed();
}

void Fit::restore(std::string_view saved) {
  if (begun_) throw Refused("Fit.restore", "this fit has begun", "restore a new one");
  SavedState state(saved);
  members(state);
  state.expect_end();
}

}  // namespace selenite
