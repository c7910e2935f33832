// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/phases.h"

#include <algorithm>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

const Problem& varied(const FitRun& run) {
  const auto& uniform = run.strategy.uniform;
  return uniform ? uniform->problem() : run.problem.scalars();
}

SceneModel varied_scene(const FitRun& run) {
  const auto& uniform = run.strategy.uniform;
  return uniform ? scene_model(run.problem, *uniform) : scene_model(run.problem);
}

int field_pass_spp(const FitSettings& settings) {
  const int spp = settings.chosen_refinement_spp();
  return settings.refinement_spp == 0 ? spp / FieldRefinementOptions{}.share_of_samples : spp;
}

/// The best values with every roughness at least where it looks perfectly sharp: nothing tells a sharper
/// body from it, but lamps that are seen in it are found the less often.
Vector start_of_field_refinement(const FitRun& run) {
  const Unknowns& unknowns = run.problem.unknowns();
  Vector x = run.result.best;
  for (int k = 0; k < unknowns.size(); ++k)
    if (unknowns.description_of(k).scale == Scale::kRoughness)
      x[k] = std::max(x[k], ReparametrizationOptions{}.low_roughness);
  return unknowns.project(x);
}

FieldGaussNewton at_best_fields(FitRun& run, FieldGaussNewton fields) {
  run.point.fields = *run.result.fields_best;
  fields.set_values(run.point.fields);
  return fields;
}

}  // namespace

MultiStartPhase::MultiStartPhase(FitRun& run, AlternativeMinima& minima)
    : rotation_(RotationStart::of(
          varied(run), stream_seed(run.problem.settings().seed, Stream::kRotationStart, 0, 0))),
      light_(run.strategy.uniform
                 ? LightStart::of(run.problem, stream_seed(run.problem.settings().seed,
                                                           Stream::kLightStart, 0, 0))
                 : nullptr),
      alignment_(AlignmentStart::of(
          run.problem.photos(),
          stream_seed(run.problem.settings().seed, Stream::kAlignmentStart, 0, 0))),
      evaluator_(varied_scene(run), run.problem.settings(), run.result),
      multi_start_(varied(run),
                   searched_photos(varied(run), run.problem.scene_at(run.problem.start())),
                   stream_seed(run.problem.settings().seed, Stream::kMultiStart, 0, 0)),
      minima_(&minima),
      uniform_(run.strategy.uniform.get()) {}

double MultiStartPhase::fraction() const {
  constexpr double kOfStart = 0.2, kFirstSearch = 0.4, kAlignment = 0.2;  // of the work
  double search = multi_start_.fraction();
  if (alignment_)
    search = alignment_->over()
                 ? kFirstSearch + kAlignment + (1 - kFirstSearch - kAlignment) * search
                 : kFirstSearch * search + kAlignment * alignment_->fraction();
  double done = 0, left = 1;
  const auto add = [&](const auto& start) {
    if (!start) return;
    done += kOfStart * left * start->fraction();
    left *= 1 - kOfStart;
  };
  add(light_);
  add(rotation_);
  return done + left * search;
}

void MultiStartPhase::members(SavedState& state) {
  if (rotation_) state(*rotation_);
  if (light_) state(*light_);
  if (state.reading() && light_ && light_->over()) uniform_->set_light(light_->fields());
  if (alignment_) state(*alignment_, evaluator_, searching_);
  state(multi_start_);
}

bool MultiStartPhase::step(FitRun& run) {
  if (light_ && !light_->over()) {
    if (!light_->step(run.evaluator)) uniform_->set_light(light_->fields());
    return !run.stop_if_dropped();
  }
  evaluator_.watch(run.evaluator.progress());
  if (rotation_ && !rotation_->over()) {
    if (!rotation_->step(evaluator_)) multi_start_.begin_at(rotation_->values());
    return !run.stop_if_dropped();
  }
  const bool more = search(run);
  if (run.stop_if_dropped()) return false;
  if (!more) hand_on(run);
  return more;
}

bool MultiStartPhase::search(FitRun& run) {
  if (searching_) {
    if (multi_start_.step(evaluator_)) return true;
    searching_ = false;
    return alignment_ && !alignment_->over();
  }
  if (alignment_->step(evaluator_, multi_start_.values())) return true;
  run.evaluator.take_alignments(evaluator_);
  if (!alignment_->moved(evaluator_, MultiStartOptions{}.size)) return false;
  multi_start_.begin_at(rotation_ ? rotation_->values() : varied(run).unknowns.start());
  searching_ = true;
  return true;
}

void MultiStartPhase::end_early(FitRun& run) {
  const bool begun = (!light_ || light_->over()) && (!rotation_ || rotation_->over());
  if (begun && multi_start_.cut_short()) hand_on(run);
}

void MultiStartPhase::hand_on(FitRun& run) {
  const Vector& x = multi_start_.values();
  run.result.search = multi_start_.result();
  if (const auto& uniform = run.strategy.uniform) {
    run.point = {uniform->scalars(x), uniform->fields(x)};
    run.result.fields_last = run.result.fields_best =
        std::make_shared<FieldValues>(run.point.fields);
  } else {
    run.point.scalars = x;
    minima_->add_candidates(multi_start_.others());
  }
  run.result.last = run.result.best = run.point.scalars;
}

RefinementPhase::RefinementPhase(const FitRun& run, AlternativeMinima& minima,
                                 const Alternative& from, const GaussNewton* optimiser)
    : refinement_(
          run.problem.scalars(), optimiser, {from.x, run.point.fields},
          stream_seed(run.problem.settings().seed, Stream::kRefinement, minima.refined(), 0),
          run.problem.settings().chosen_refinement_spp(), run.problem.settings().spp),
      minima_(&minima) {
  refinement_.hold(from.absent);
}

bool RefinementPhase::step(FitRun& run) {
  refinement_.watch(run.evaluator.progress());
  const bool more = refinement_.step(run.evaluator);
  if (run.stop_if_dropped()) return false;
  if (!more) minima_->take(run, refinement_);
  return more;
}

FieldRefinementPhase::FieldRefinementPhase(FitRun& run, FieldGaussNewton fields,
                                           const GaussNewton* optimiser, bool roughness_known)
    : refinement_(run.problem.scalars(), optimiser, start_of_field_refinement(run),
                  at_best_fields(run, std::move(fields)),
                  stream_seed(run.problem.settings().seed, Stream::kRefinement, roughness_known, 0),
                  field_pass_spp(run.problem.settings()), run.problem.settings().spp,
                  {.roughness_known = roughness_known}) {}

bool FieldRefinementPhase::step(FitRun& run) {
  const bool more = refinement_.step(run.evaluator);
  run.point.fields = refinement_.point().fields;
  run.result.fields_last = std::make_shared<FieldValues>(run.point.fields);
  if (run.stop_if_dropped()) return false;
  if (more) return true;
  // Where the validation finds its values worse, the linear step to them went too far.
  const Vector x = refinement_.point().scalars;
  if (!run.accept(x, run.validate({x, run.point.fields}))) refinement_.accept(run.result.best);
  run.result.report = refinement_.report();
  return false;
}

bool ComparisonPhase::step(FitRun& run) {
  const bool more = comparison_->step(run.evaluator);
  if (run.stop_if_dropped()) return false;
  if (!more) minima_->take(run, *comparison_);
  return more;
}

}  // namespace selenite
