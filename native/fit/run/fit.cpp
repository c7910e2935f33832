// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit.h"

#include "fit/run/failure.h"
#include "math/error.h"

namespace selenite {

Fit::Fit(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
         FitSettings settings)
    : Fit(std::make_shared<FitProblem>(std::move(scene), std::move(photos), unknowns,
                                       std::move(settings))) {}

Fit::Fit(std::shared_ptr<FitProblem> problem)
    : shared_(problem), problem_(*problem), strategy_(problem_), run_(problem_, strategy_) {
  enter(first_phase());
}

std::unique_ptr<Phase> Fit::first_phase() {
  if (strategy_.moves_vertices) return std::make_unique<ShapeDescent>(run_);
  if (strategy_.multi_start) return std::make_unique<MultiStartPhase>(run_, minima_);
  return std::make_unique<Descent>(run_);
}

std::vector<PlannedRenders> Fit::plan(const FitProblem& problem, const Strategy& strategy) {
  RenderPlan plan(problem, strategy);
  if (strategy.moves_vertices) {
    ShapeDescent::plan(plan);
    return plan.renders();
  }
  if (strategy.multi_start) MultiStartPhase::plan(plan);
  Descent::plan(plan);
  plan.validate(strategy.refines ? PhaseKind::kRefinement : PhaseKind::kDescent,
                static_cast<double>(problem.fields().refs().size()));
  if (!strategy.refines) return plan.renders();
  if (strategy.joint) {
    FieldRefinementPhase::plan(plan);
    if (strategy.profiles_roughness()) RoughnessProfile::plan(plan);
    return plan.renders();
  }
  RefinementPhase::plan(plan);
  ComparisonPhase::plan(plan);
  return plan.renders();
}

bool Fit::step(Progress* progress) {
  if (run_.result.stopped != StopReason::kNone) return false;
  begun_ = true;
  run_.evaluator.watch(progress);
  try {
    const bool more = phase_->step(run_);
    run_.result.phase_fraction = phase_->fraction();
    if (run_.result.stopped != StopReason::kNone) return false;
    if (!more) enter(next_phase());
    return run_.result.stopped == StopReason::kNone;
  } catch (const Cancelled&) {
    phase_->end_early(run_);
    return run_.stop(StopReason::kCancelled);
  } catch (const std::exception& error) {
    faults_ = failure(error, "Iteration " + std::to_string(run_.result.iterations));
    return run_.stop(StopReason::kError);
  }
}

void Fit::enter(std::unique_ptr<Phase> phase) {
  if (!phase) {
    run_.explain_fields();
    run_.stop(run_.result.iterations < all_iterations() ? StopReason::kConverged
                                                        : StopReason::kIterations);
    return;
  }
  phase_ = std::move(phase);
  run_.result.phase = phase_->kind();
  run_.result.phase_fraction = 0;
}

std::unique_ptr<Phase> Fit::next_phase() {
  switch (phase_->kind()) {
    case PhaseKind::kMultiStart:
      return std::make_unique<Descent>(run_);
    case PhaseKind::kDescent:
      return strategy_.refines ? refinement_of_best(dynamic_cast<Descent&>(*phase_)) : nullptr;
    case PhaseKind::kRefinement:
      if (strategy_.joint)
        return RoughnessProfile::of(
            run_, dynamic_cast<const FieldRefinementPhase&>(*phase_).refinement());
      if (auto comparison = minima_.comparison(run_))
        return std::make_unique<ComparisonPhase>(std::move(comparison), minima_);
      return PartsPhase::of(run_, minima_.absent());
    case PhaseKind::kRoughnessProfile: {
      const auto& profile = dynamic_cast<const RoughnessProfile&>(*phase_);
      if (!profile.moved()) return nullptr;
      return std::make_unique<FieldRefinementPhase>(
          run_, profile.fields(), std::make_unique<GaussNewton>(profile.instruments()), true);
    }
    case PhaseKind::kComparison:
      // At the bottom of its basin an alternative may win or lose. The instruments of other values say
      // little about it.
      if (const auto alternative = minima_.next())
        return std::make_unique<RefinementPhase>(run_, minima_, *alternative, nullptr);
      return PartsPhase::of(run_, minima_.absent());
    case PhaseKind::kParts:
    case PhaseKind::kShape:
      return nullptr;
  }
  return nullptr;
}

std::unique_ptr<Phase> Fit::refinement_of_best(Descent& descent) {
  if (const JointGaussNewton* joint = descent.joint())
    return std::make_unique<FieldRefinementPhase>(run_, joint->field_solver(),
                                                  std::make_unique<GaussNewton>(joint->scalars()));
  return std::make_unique<RefinementPhase>(run_, minima_, Alternative{run_.result.best},
                                           descent.hand_over_gauss_newton());
}

}  // namespace selenite
