// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/phases.h"

#include <algorithm>
#include <cmath>
#include <iterator>

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

int field_pass_spp(const FitSettings& settings, const Strategy& strategy) {
  constexpr FieldRefinementOptions kOptions;
  const int spp = settings.chosen_refinement_spp();
  if (settings.refinement_spp != 0) return spp;
  return spp / (strategy.has_images ? kOptions.share_with_texels : kOptions.share_of_samples);
}

/// The best values with every roughness at least where it looks perfectly sharp: nothing separates a sharper
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

/// Beside one colour for all texels a search may end at a transmission of 0, from where texels that make up
/// for it let it go only slowly. The way back to 0 is short.
Vector off_zero(const Unknowns& unknowns, Vector x) {
  constexpr double kLeast = 0.25;
  for (int k = 0; k < unknowns.size(); ++k)
    if (unknowns.description_of(k).optional) x[k] = std::max(x[k], kLeast);
  return unknowns.project(x);
}

constexpr MultiStartOptions kSearched;

void plan_search(RenderPlan& plan, const SceneModel& model, double pixels, double times) {
  const auto evaluate = [&](double candidates, int spp) {  // in two halves
    plan.add(PhaseKind::kMultiStart, pixels, spp / 2, times * 2 * candidates, Carried::kNothing);
  };
  const Point start{model.problem.unknowns.start(), {}};
  const RenderPlan::Renders step =
      plan.renders_of(model, plan.strategy.uniform ? start : plan.problem.start(),
                      Purpose::kInstrumental, {alternating_side(0)});
  evaluate(kSearched.points + 1, kSearched.first_spp);
  const bool few = std::ssize(model.problem.unknowns.parameters()) < kExpected.few_parameters;
  const double distinct = few ? kExpected.distinct : 1;
  for (const auto& [count, steps] : kSearched.rounds) {
    plan.add(PhaseKind::kMultiStart, pixels, kSearched.step_spp,
             times * distinct * (count + 1) * steps, step);
    evaluate(distinct * (count + 2), kSearched.step_spp);
  }
  evaluate(distinct * kExpected.last_candidates, kSearched.final_spp);
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
    if (run.strategy.joint && run.strategy.has_images && run.strategy.refines)
      run.point.scalars = off_zero(run.problem.unknowns(), run.point.scalars);
    run.result.fields_last = run.result.fields_best =
        std::make_shared<FieldValues>(run.point.fields);
  } else {
    run.point.scalars = x;
    minima_->add_candidates(multi_start_.others());
  }
  run.result.last = run.result.best = run.point.scalars;
}

RefinementPhase::RefinementPhase(const FitRun& run, AlternativeMinima& minima,
                                 const Alternative& from, std::unique_ptr<GaussNewton> optimiser)
    : refinement_(
          run.problem.scalars(), std::move(optimiser), {from.x, run.point.fields},
          stream_seed(run.problem.settings().seed, Stream::kRefinement, minima.refined(), 0),
          run.problem.settings().chosen_refinement_spp(), run.problem.settings().spp,
          {.precision = run.problem.settings().precision}),
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
                                           std::unique_ptr<GaussNewton> optimiser,
                                           bool roughness_known)
    : refinement_(run.problem.scalars(), std::move(optimiser), start_of_field_refinement(run),
                  at_best_fields(run, std::move(fields)),
                  stream_seed(run.problem.settings().seed, Stream::kRefinement, roughness_known, 0),
                  field_pass_spp(run.problem.settings(), run.strategy), run.problem.settings().spp,
                  {.roughness_known = roughness_known}) {}

/// A texel shows in few pixels: its derivatives are of the values of the pass, and of more samples than those
/// of the descent.
void FieldRefinementPhase::gather_texels(FitRun& run) {
  FieldGaussNewton& fields = refinement_.fields();
  const FitSettings& settings = run.problem.settings();
  const double weight = refinement_.pass_weight();
  const int spp = std::max(1, static_cast<int>(std::lround(weight * settings.spp)));
  const std::uint64_t seed = stream_seed(settings.seed, Stream::kTexels,
                                         refinement_.report().passes, static_cast<int>(gathered_));
  const FieldJacobian found = run.evaluator.field_jacobian(
      refinement_.point(), run.problem.photos()[gathered_], run.problem.fields(),
      fields.shares(gathered_), fields.cell(), {spp, seed});
  fields.gather(gathered_, found, weight);
}

bool FieldRefinementPhase::step(FitRun& run) {
  if (refinement_.fields().has_images() && refinement_.begins_pass()) {
    if (gathered_ < run.problem.photos().size()) {
      gather_texels(run);
      ++gathered_;
      return !run.stop_if_dropped();
    }
    gathered_ = 0;
  }
  const bool more = refinement_.step(run.evaluator);
  run.point.fields = refinement_.point().fields;
  run.result.fields_last = std::make_shared<FieldValues>(run.point.fields);
  if (run.stop_if_dropped()) return false;
  if (more) return true;
  // Where the validation finds its values worse, the linear step to them went too far.
  const Vector x = refinement_.point().scalars;
  if (!run.accept(x, run.validate({x, run.point.fields}))) refinement_.accept(run.result.best);
  run.result.report = refinement_.report();
  for (FieldPattern& one : run.result.patterns) one.left = refinement_.fields().pattern_left();
  return false;
}

bool ComparisonPhase::step(FitRun& run) {
  const bool more = comparison_->step(run.evaluator);
  if (run.stop_if_dropped()) return false;
  if (!more) minima_->take(run, *comparison_);
  return more;
}

void MultiStartPhase::plan(RenderPlan& plan) {
  std::vector<Photo> small;
  for (const Photo& photo : plan.problem.photos()) small.push_back(photo.resized(kSearched.size));
  if (LightStart::of(plan.problem, 0)) {
    constexpr LightStartOptions kLight;
    plan.add(PhaseKind::kMultiStart, pixels_of(small), kLight.spp, kLight.passes,
             Carried::kFieldDerivatives);
  }
  const SceneModel model = plan.strategy.uniform ? scene_model(plan.problem, *plan.strategy.uniform)
                                                 : scene_model(plan.problem);
  if (RotationStart::of(model.problem, 0)) {
    constexpr RotationStartOptions kRotation;
    std::vector<Photo> larger;
    for (const Photo& photo : plan.problem.photos())
      larger.push_back(photo.resized(kRotation.size));
    plan.add(PhaseKind::kMultiStart, pixels_of(larger), kRotation.spp,
             kRotation.angles + 2 * kRotation.halvings, Carried::kNothing);
  }
  double searches = 1;
  if (const auto alignment = AlignmentStart::of(plan.problem.photos(), 0)) {
    constexpr AlignmentStartOptions kStart;
    if (alignment->may_move(kSearched.size)) ++searches;
    std::vector<Photo> aligned;
    std::ranges::copy_if(plan.problem.photos(), std::back_inserter(aligned), &Photo::align);
    plan.add(PhaseKind::kMultiStart, pixels_of(aligned), kStart.spp, kStart.passes,
             Carried::kNothing);
  }
  std::vector<Photo> searched;
  const Scene scene = plan.problem.scene_at(plan.problem.start());
  for (const std::size_t i : searched_photos(model.problem, scene)) searched.push_back(small[i]);
  plan_search(plan, model, pixels_of(searched), searches);
}

void RefinementPhase::plan(RenderPlan& plan) {
  constexpr RefinementOptions kOptions;
  const int spp = plan.problem.settings().chosen_refinement_spp();
  const auto pass_spp = [&](int share) {
    return std::min(spp, std::max(spp / share, kOptions.least_of_pass));
  };
  const RenderPlan::Renders up =
      plan.renders_of(Purpose::kInstrumental, differences_of_refinement(0));
  if (!plan.strategy.optimiser.averages_iterations)
    plan.add(PhaseKind::kRefinement, plan.pixels,
             std::max(pass_spp(kFirstShare) / kOptions.derivative_share, kLeastOfDerivatives),
             kOptions.warm_ups, up);
  const auto pass = [&](int samples, double times) {
    plan.add(PhaseKind::kRefinement, plan.pixels, samples, times, Carried::kNothing);
    plan.add(PhaseKind::kRefinement, plan.pixels,
             std::max(samples / kOptions.derivative_share / kJacobianPortions, kLeastOfDerivatives),
             kJacobianPortions * times, up);
  };
  pass(pass_spp(kFirstShare), 1);
  pass(pass_spp(kSecondShare), 1);
  pass(spp, kExpected.passes - 2);
  plan.validate(PhaseKind::kRefinement, 1);
}

/// A roughness looks sharp there, mostly, and is left out.
void FieldRefinementPhase::plan(RenderPlan& plan) {
  constexpr FieldRefinementOptions kOptions;
  const int spp = field_pass_spp(plan.problem.settings(), plan.strategy);
  const RenderPlan::Renders both =
      plan.renders_of(Purpose::kInstrumental, differences_of_field_refinement(false));
  const double informative = plan.pixels * kExpected.informative_pixels / kInformativePixels.one_of;
  bool pilot = true;
  for (const int share : kOptions.shares_of(plan.strategy.has_images)) {
    const int of_pass = std::min(spp, std::max(spp / share, kOptions.least_of_pass));
    const int derivatives = pilot ? of_pass * kOptions.pilot : of_pass / kOptions.share_after_pilot;
    plan.add(PhaseKind::kRefinement, plan.pixels, of_pass, 1, Carried::kNothing);
    plan.add(PhaseKind::kRefinement, plan.pixels,
             std::max(derivatives / kJacobianPortions, kLeastOfDerivatives), kJacobianPortions,
             both);
    const int closer = kOptions.informative_samples * of_pass;
    plan.add(PhaseKind::kRefinement, informative, closer, 1, Carried::kNothing);
    plan.add(PhaseKind::kRefinement, informative,
             closer / (kOptions.informative_derivative_share * kJacobianPortions),
             kJacobianPortions, both);
    pilot = false;
    if (plan.strategy.has_images)
      plan.add(PhaseKind::kRefinement, plan.pixels, of_pass, 1, Carried::kFieldDerivatives);
  }
  plan.validate(PhaseKind::kRefinement, 1);
}

void ComparisonPhase::plan(RenderPlan& plan) {
  const int spp = plan.problem.settings().chosen_refinement_spp();
  double alternatives = static_cast<double>(
      plan.problem.unknowns().exchanged(plan.problem.unknowns().start()).size());
  if (plan.strategy.multi_start && !plan.strategy.uniform) alternatives += kExpected.alternatives;
  if (alternatives == 0) return;
  const int of_round = std::max(spp / kAlternativeMinima.shares.front(),
                                std::min(kAlternativeMinima.least_of_round, spp));
  plan.add(PhaseKind::kComparison, plan.pixels, std::max(of_round / 2, 2), 2 * (1 + alternatives),
           Carried::kNothing);
}

}  // namespace selenite
