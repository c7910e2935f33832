// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/descent.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "fit/evaluate/seeds.h"
#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "math/unused_memory.h"

namespace selenite {

namespace {

/// Last step of an image of numbers without a multi-start, in learning rates.
/// Measured: docs/measurements/fields.md, "Maps".
constexpr double kLastRateOfNumbers = 0.1;

/// After a step: what follows takes memory too. Small pictures are not worth a walk through all that is free.
void forget_derivatives(std::vector<Observation>& seen) {
  constexpr std::size_t kMuch = 1 << 24;  // pixels of all slots
  std::size_t freed = 0;
  for (Observation& one : seen) {
    freed += one.film.size() * one.film.slots.size();
    one.film.slots = std::vector<SlotFilm>();
  }
  if (freed > kMuch) return_unused_memory();
}

double count_of(const std::vector<Photo>& photos) {
  double count = 0;
  for (const Photo& photo : photos) count += selenite::count_of(photo);
  return count;
}

/// Iors that a line search finds.
int searched_iors(const RenderPlan& plan) {
  return plan.strategy.searches_ior() ? plan.count_of(Scale::kLogExcess) : 0;
}

bool restart_is_due(const RenderPlan& plan, bool first) {
  if (!plan.strategy.prefers_low_roughness() || (first && !plan.strategy.searches_ior()))
    return false;
  return plan.count_of(Scale::kRoughness) > 0 || searched_iors(plan) > 0;
}

/// Also what stands in its place where nothing is to be compared: a validation.
void plan_restart(RenderPlan& plan) {
  const double candidates = plan.count_of(Scale::kRoughness) > 0 ? kExpected.restart_candidates : 1;
  plan.validate(PhaseKind::kDescent, candidates);
  plan.add(PhaseKind::kDescent, plan.pixels, plan.problem.settings().spp,
           candidates * searched_iors(plan) * kExpected.line_search_renders, Carried::kNothing);
}

}  // namespace

struct Descent::Next {
  Point point;
  std::optional<FieldsByAdam> by_adam;
  std::unique_ptr<JointGaussNewton> joint;
  /// A copy where the optimiser steps between renders: a cancelled iteration leaves no trace.
  std::unique_ptr<Optimiser> optimiser;
  std::vector<FieldStep> how;
  std::vector<Observation> seen{};
  std::vector<std::vector<double>> gradients{};
  double misfit = 0;  ///< sum of the losses behind them
  int samples = 1;    ///< of this iteration, in units of the usual ones
};

Descent::Descent(const FitRun& run, DescentOptions options)
    : problem_(&run.problem),
      strategy_(&run.strategy),
      options_(options),
      blocks_(run.strategy.blocks(run.problem)),
      restart_(run) {
  if (strategy_->joint) {
    joint_ = std::make_unique<JointGaussNewton>(problem_->scalars(), problem_->fields(),
                                                run.point.fields, GaussNewtonOptions{},
                                                FieldGaussNewtonOptions::of(problem_->settings()));
  } else {
    optimiser_ = strategy_->optimiser.make(problem_->scalars());
    by_adam_.emplace(problem_->fields());
  }
}

const GaussNewton* Descent::gauss_newton() const {
  return joint_ ? &joint_->scalars() : dynamic_cast<const GaussNewton*>(optimiser_.get());
}

std::unique_ptr<GaussNewton> Descent::hand_over_gauss_newton() {
  auto* const scalars = dynamic_cast<GaussNewton*>(optimiser_.get());
  return scalars ? std::make_unique<GaussNewton>(std::move(*scalars)) : nullptr;
}

bool Descent::step(FitRun& run) {
  if (!restart_.running()) return iterate(run);
  const bool more = restart_.step(run);
  if (run.stop_if_dropped()) return false;
  if (more) return true;
  if (restart_.moved() && optimiser_) optimiser_->reset_everything();
  return is_over(run) ? finish(run) : true;
}

bool Descent::iterate(FitRun& run) {
  FitResult& result = run.result;
  const Block block = blocks_.block(result.iterations);
  if (block.first && block.scalars && begin_restart(run)) return true;
  const bool due = (block.first && (block.scalars || !joint_ || result.iterations == 0)) ||
                   (!strategy_->after_multi_start() &&
                    result.iterations % problem_->settings().validation_interval == 0);
  Validation validation;
  if (due) validation = restart_.found() ? *restart_.found() : run.validate(run.point);
  if (!run.best.has_start()) {
    const bool here = due && !strategy_->multi_start && !restart_.found();
    run.best.note_start(here ? validation : run.validate(problem_->start()));
  }
  const bool reverted = strategy_->alternates && block.first && due &&
                        is_worse(validation, run.best.validation(), options_.revert_sigmas);
  if (reverted) validation = run.best.validation();
  const Point best = reverted ? Point{result.best, *result.fields_best} : Point{};
  const Point& from = reverted ? best : run.point;
  HistoryRow row = run.row(from);
  Next next{from, by_adam_, joint_ ? std::make_unique<JointGaussNewton>(*joint_) : nullptr,
            problem_->settings().accumulate ? nullptr : optimiser_->clone(), field_steps(run)};
  next.samples = strategy_->samples(*problem_, result.iterations);
  if (next.joint && reverted) next.joint->set_fields(from.fields);
  observe_photos(run, block, row, next);
  const double keep = kept();
  watch(run.evaluator.progress(), next);
  step_all(block, reverted, next);
  watch(nullptr, next);
  forget_derivatives(next.seen);
  problem_->scalars().weights->learn(next.seen, keep, done_ + 1);
  next.seen.clear();  // the films of all photos: what follows takes memory too
  restart_.forget();
  run.point.scalars = result.last = from.scalars;
  if (reverted) result.fields_last = result.fields_best;
  if (due) run.best.note(row, validation, result);
  result.history.push_back(row);
  if (run.stop_if_dropped()) return false;
  if (due && within_tolerance(run)) return run.stop(StopReason::kTolerance);
  run.point.scalars = result.last = problem_->unknowns().project(next.point.scalars);
  run.point.fields = std::move(next.point.fields);
  by_adam_ = std::move(next.by_adam);
  joint_ = std::move(next.joint);
  if (block.fields && strategy_->after_multi_start() && !joint_) smooth_images(run, block);
  if (!problem_->fields().empty())
    result.fields_last = std::make_shared<FieldValues>(run.point.fields);
  run.follow_weights();
  done_ = ++result.iterations;
  return is_over(run) ? finish(run) : true;
}

Evaluation Descent::of_step(const FitRun& run, std::size_t index) const {
  const FitSettings& settings = problem_->settings();
  const int spp = settings.spp * strategy_->samples(*problem_, run.result.iterations);
  return {spp, stream_seed(settings.seed, Stream::kStep, run.result.iterations,
                           static_cast<int>(index))};
}

Evaluation Descent::with_derivatives(const FitRun& run, const Evaluation& how) const {
  const Purpose purpose = strategy_->optimiser.purpose;
  Differences which =
      differences_of(purpose, blocks_.count(&Block::scalars, run.result.iterations));
  which.refractions = !strategy_->searches_ior();
  return {how.spp, how.seed, which, purpose};
}

bool Descent::steps_scalars(const Block& block) const {
  return block.scalars && (problem_->fields().empty() || problem_->unknowns().size() > 0);
}

/// Renders one photo; gradients by the fields, where it is their block, are summed over the photos.
void Descent::observe(FitRun& run, std::size_t index, const Block& block, Next& next) const {
  const Photo& photo = problem_->photos()[index];
  const Evaluation how = of_step(run, index);
  Observation seen;
  seen.photo = static_cast<int>(index);
  if (block.fields && next.joint) {
    FieldJacobian found = run.evaluator.field_jacobian(next.point, photo, problem_->fields(),
                                                       next.joint->field_solver().shares(index),
                                                       next.joint->field_solver().cell(), how);
    seen.film = std::move(found.film);
    next.joint->gather_fields(index, std::move(found), next.samples);
  } else if (block.fields) {
    FieldGradient found = run.evaluator.field_gradient(
        next.point, photo, problem_->fields(),
        {problem_->loss(), problem_->scalars().weights->of_loss(index)}, how);
    next.gradients.resize(found.fields.size());
    next.by_adam->agreement.add(found.fields);
    for (std::size_t f = 0; f < next.gradients.size(); ++f) {
      std::vector<double>& sum = next.gradients[f];
      sum.resize(found.fields[f].size());
      std::transform(sum.begin(), sum.end(), found.fields[f].begin(), sum.begin(), std::plus<>());
    }
    seen.film = std::move(found.film);
  }
  if (steps_scalars(block))
    seen.film = run.evaluator.evaluate(next.point, photo, with_derivatives(run, how));
  seen.loss = evaluate_loss(problem_->scalars(), index, seen.film);
  if (strategy_->optimiser.purpose == Purpose::kInstrumental)
    seen.loss.slope = seen.loss.curvature = Picture();  // no step by residuals reads them
  next.misfit += std::max(0.0, seen.loss.unbiased);
  run.previews[index] = std::make_shared<const Picture>(seen.film.mean);
  next.seen.push_back(std::move(seen));
}

void Descent::observe_photos(FitRun& run, const Block& block, HistoryRow& row, Next& next) const {
  const std::vector<Photo>& photos = problem_->photos();
  const bool accumulate = problem_->settings().accumulate;
  const double share = 1.0 / static_cast<double>(photos.size());
  const bool one_point = accumulate && !block.fields && steps_scalars(block);
  Ahead ahead;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    if (one_point)
      ahead.reach(run.evaluator, i, photos.size(), [&](std::size_t k) {
        run.evaluator.expect(next.point, photos[k], with_derivatives(run, of_step(run, k)));
      });
    observe(run, i, block, next);
    if (i + 1 == photos.size() && next.by_adam) next.by_adam->agreement.end_round();
    row.loss += share * next.seen.back().loss.value;
    row.mean_bias += mean_bias(next.seen.back().film, photos[i]) * share;
    if (block.fields && !next.joint && (strategy_->after_multi_start() || !accumulate)) {
      step_fields(next);
    }
    if (accumulate) continue;
    next.point.scalars = next.optimiser->step(next.point.scalars, std::span(next.seen).last<1>());
  }
}

/// What steps takes seconds where there are many photos.
void Descent::watch(const Progress* progress, const Next& next) {
  if (optimiser_) optimiser_->watch(progress);
  if (next.joint) next.joint->watch(progress);
}

void Descent::step_all(const Block& block, bool reverted, Next& next) {
  if (next.optimiser) {
    optimiser_ = std::move(next.optimiser);
    return;
  }
  Vector& x = next.point.scalars;
  if (next.joint) {
    if (reverted) next.joint->reset_equations();
    x = block.scalars ? next.joint->step(x, next.seen)
                      : next.joint->step_by_residuals(x, next.seen, next.samples);
    next.point.fields = next.joint->fields();
    return;
  }
  if (reverted || (block.scalars && block.first)) optimiser_->reset_equations();
  if (block.scalars) x = optimiser_->step(x, next.seen);
  if (block.fields && strategy_->after_multi_start())
    x = dynamic_cast<ResidualOptimiser&>(*optimiser_).step_by_residuals(x, next.seen);
  if (block.fields && !strategy_->after_multi_start()) step_fields(next);
}

/// By the gradients of the photos since the last step.
void Descent::step_fields(Next& next) const {
  const bool by_agreement = problem_->settings().by_agreement();
  for (std::size_t f = 0; f < next.how.size(); ++f) {
    const double pattern = by_agreement ? next.by_adam->agreement.share(f) : 0;
    next.how[f].prior = {(1 - pattern) * next.misfit, count_of(problem_->photos())};
  }
  next.by_adam->adam.step(next.point.fields, next.gradients, next.how);
  next.gradients.clear();
  next.misfit = 0;
}

/// Share of earlier residuals that still counts: the values have moved since.
double Descent::kept() const {
  const GaussNewton* const scalars = gauss_newton();
  if (!scalars) return options_.kept;
  return std::max(scalars->damping().kept(), GaussNewtonOptions{}.least_jacobian_kept);
}

bool Descent::is_over(const FitRun& run) const {
  return run.result.iterations >= strategy_->most_iterations(*problem_) ||
         (strategy_->refines && (joint_ ? joint_->converged() : optimiser_->converged()));
}

bool Descent::begin_restart(const FitRun& run) {
  return restart_.begin(run, blocks_.count(&Block::scalars, run.result.iterations) == 0);
}

/// Accepts the optimiser's estimate, once it has been compared with low roughness.
bool Descent::finish(FitRun& run) {
  if (!weighed_) problem_->scalars().weights->weigh_answer();
  weighed_ = true;
  run.follow_weights();
  // Beside fields the last values: each block of scalars begins afresh.
  const Vector x = strategy_->alternates
                       ? run.point.scalars
                       : problem_->unknowns().project(optimiser_->estimate(run.point.scalars));
  if (!run.best.may_yield(x, run.result) && begin_restart(run)) return true;
  for (std::size_t f = 0; f < run.result.patterns.size(); ++f)
    run.result.patterns[f].left =
        joint_ ? joint_->field_solver().pattern_left() : by_adam_->agreement.share(f);
  const Validation validation =
      restart_.found() ? *restart_.found() : run.validate({x, run.point.fields});
  if (!run.best.yields(x, validation, run.result) && begin_restart(run)) return true;
  run.accept(x, validation);
  restart_.forget();
  run.stop_if_dropped();
  return false;
}

bool Descent::within_tolerance(const FitRun& run) const {
  double sum = 0;
  int found = 0;
  for (auto row = run.result.history.rbegin(); row != run.result.history.rend(); ++row) {
    if (std::isnan(row->validation)) continue;
    sum += row->validation;
    if (++found == options_.tolerance_window) break;
  }
  const double tolerance = problem_->settings().tolerance;
  return tolerance > 0 && found == options_.tolerance_window &&
         sum / options_.tolerance_window < tolerance;
}

/// Derivatives by numbers such as a roughness are mostly noise. Without a multi-start their steps become short and
/// narrow: those of texels that hardly show would be random walks as long as the steps of any other.
/// After a multi-start fields are still uniform, have far to go and few steps: these begin long and, of
/// images, wide. Those of images end short and narrow, as the noise of texels looks like detail, and a
/// slightly rough body then explains the photos better than the right one. Voxels have farther to go.
std::vector<FieldStep> Descent::field_steps(const FitRun& run) const {
  const Fields& fields = problem_->fields();
  std::vector<FieldStep> steps(fields.refs().size());
  const bool searched = strategy_->after_multi_start();
  if (!searched && !strategy_->has_images) return steps;
  const double done = static_cast<double>(blocks_.count(&Block::fields, run.result.iterations)) /
                      blocks_.count(&Block::fields, problem_->settings().iterations);
  const auto between = [done](double first, double last) { return first + (last - first) * done; };
  const double pixels = count_of(problem_->photos()) / 3;
  const auto side = [&](double share) {
    return std::sqrt(std::min(share / pixels, options_.largest_spread));
  };
  const double spread =
      std::pow(between(side(options_.first_spread), side(options_.last_spread)), 2);
  // Each photo makes a step.
  const double share = 1 / std::sqrt(static_cast<double>(problem_->photos().size()));
  for (std::size_t f = 0; f < steps.size(); ++f) {
    if (searched)
      steps[f] = {
          share * between(options_.first_rate, fields.on_surface(f) ? options_.last_rate : 1),
          spread};
    else if (fields.on_surface(f) && fields.channels(f) == 1)
      steps[f] = {between(1, kLastRateOfNumbers), spread};
  }
  return steps;
}

/// A block of an image ends at a mean of its steps: noise that is left in the steps of texels looks like
/// detail. Voxels have farther to go and stay as they are.
void Descent::smooth_images(FitRun& run, const Block& block) {
  FieldValues& values = run.point.fields;
  if (block.first) field_means_ = values;
  const bool ends = blocks_.block(run.result.iterations + 1).scalars;
  for (std::size_t f = 0; f < values.size(); ++f) {
    if (!problem_->fields().on_surface(f)) continue;
    field_means_[f] += options_.newest * (values[f] - field_means_[f]);
    if (ends) values[f] = field_means_[f];
  }
}

double Descent::fraction() const {
  return std::min(1.0, static_cast<double>(done_) / blocks_.iterations());
}

void Descent::members(SavedState& state) {
  if (joint_) {
    state(*joint_);
  } else {
    optimiser_->members(state);
    state(by_adam_->adam, by_adam_->agreement);
  }
  state(field_means_, restart_, done_, weighed_);
}

void Descent::plan(RenderPlan& plan) {
  const BlockSchedule blocks = plan.strategy.blocks(plan.problem);
  const FitSettings& settings = plan.problem.settings();
  int iterations = blocks.iterations();
  if (plan.strategy.refines && plan.problem.fields().empty() &&
      plan.strategy.optimiser.averages_iterations)
    iterations = std::min(iterations, kExpected.converged_after);
  int scalar_iterations = 0;
  if (plan.strategy.multi_start) plan.validate(PhaseKind::kDescent, 1);  // of the user's start
  for (int i = 0; i < iterations; ++i) {
    const Block block = blocks.block(i);
    const bool starts_scalars = block.first && block.scalars;
    const bool restarts = starts_scalars && restart_is_due(plan, scalar_iterations == 0);
    const bool due = (block.first && (block.scalars || !plan.strategy.joint || i == 0)) ||
                     (!plan.strategy.after_multi_start() && i % settings.validation_interval == 0);
    if (restarts)
      plan_restart(plan);
    else if (due)
      plan.validate(PhaseKind::kDescent, 1);
    if (block.fields) {
      // A loss that is no sum over pixels has its slopes from a render before.
      const int renders = plan.strategy.joint || plan.problem.loss().per_pixel ? 1 : 2;
      plan.add(PhaseKind::kDescent, plan.pixels,
               settings.spp * plan.strategy.samples(plan.problem, i), renders,
               Carried::kFieldDerivatives);
    }
    if (!block.scalars) continue;
    if (plan.problem.fields().empty() || plan.problem.unknowns().size() > 0) {
      Differences which = differences_of(plan.strategy.optimiser.purpose, scalar_iterations);
      which.refractions = !plan.strategy.searches_ior();
      plan.add(PhaseKind::kDescent, plan.pixels, settings.spp, 1,
               plan.renders_of(plan.strategy.optimiser.purpose, which));
    }
    ++scalar_iterations;
  }
  if (restart_is_due(plan, false))
    plan_restart(plan);
  else
    plan.validate(PhaseKind::kDescent, 1);
}

}  // namespace selenite
