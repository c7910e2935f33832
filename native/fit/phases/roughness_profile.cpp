// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/roughness_profile.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/seeds.h"
#include "fit/objective/half_buffers.h"
#include "fit/objective/photo_weights.h"
#include "fit/state/low_roughness.h"

namespace selenite {

std::unique_ptr<RoughnessProfile> RoughnessProfile::of(const FitRun& run,
                                                       const FieldRefinement& refinement) {
  if (!run.strategy.profiles_roughness() || refinement.roughness_known()) return nullptr;
  const Unknowns& unknowns = run.problem.unknowns();
  std::vector<int> components;
  for (int k = 0; k < unknowns.size(); ++k)
    if (unknowns.description_of(k).scale == Scale::kRoughness) components.push_back(k);
  if (components.empty()) return nullptr;
  return std::unique_ptr<RoughnessProfile>(new RoughnessProfile(
      run, refinement.fields(), refinement.gauss_newton(), std::move(components)));
}

RoughnessProfile::RoughnessProfile(const FitRun& run)
    : RoughnessProfile(run,
                       *FieldGaussNewton::of(run.problem.fields(), run.problem.photos(),
                                             FieldGaussNewtonOptions::of(run.problem.settings())),
                       GaussNewton(run.problem.scalars()), {}) {}

RoughnessProfile::RoughnessProfile(const FitRun& run, const FieldGaussNewton& fields,
                                   GaussNewton instruments, std::vector<int> components)
    : problem_(&run.problem),
      instruments_(std::move(instruments)),
      components_(std::move(components)),
      chosen_{run.result.best, fields},
      tried_(chosen_) {
  tried_.fields.set_values(*run.result.fields_best);
}

bool RoughnessProfile::begin_next() {
  for (; which_ < components_.size(); ++which_, tried_ = chosen_) {
    const int k = components_[which_];
    const double highest = problem_->unknowns().maximum()[k];
    double& roughness = tried_.scalars[k];
    if (!(roughness < highest)) continue;
    roughness = std::min(std::max(roughness * options_.factor, options_.least), highest);
    tried_.fields.set_values(tried_.fields.values());  // no residual has been seen there
    pass_ = 0;
    return true;
  }
  return false;
}

/// Noise of the light may hide a better roughness beyond one that is only a little worse.
bool RoughnessProfile::is_clearly_worse(const Validation& found) const {
  const double deviation = std::sqrt(found.variance + smallest_.variance);
  return found.unbiased > smallest_.unbiased + options_.sigmas * deviation &&
         is_worse(found, smallest_, 1);
}

void RoughnessProfile::solve_light(FitRun& run) {
  const FitSettings& settings = problem_->settings();
  const std::vector<Photo>& photos = problem_->photos();
  const Point here{tried_.scalars, tried_.fields.values()};
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const std::uint64_t seed = stream_seed(settings.seed, Stream::kRoughnessProfile,
                                           tries_ * options_.passes + pass_, static_cast<int>(i));
    const FieldJacobian found = run.evaluator.field_jacobian(
        here, photos[i], problem_->fields(), tried_.fields.shares(i), tried_.fields.cell(),
        {settings.spp * options_.light_samples, seed});
    run.previews[i] = std::make_shared<const Picture>(found.film.mean);
    tried_.fields.gather(i, found);
    tried_.fields.add_residual(i, residual_halves(found.film, photos[i]),
                               (*problem_->scalars().weights)[i], options_.kept);
  }
  tried_.fields.solve(1);
  tried_.fields.advance(Vector::Zero(problem_->unknowns().size()));
}

bool RoughnessProfile::step(FitRun& run) {
  if (pass_ < options_.passes) {
    solve_light(run);
    ++pass_;
    return !run.stop_if_dropped();
  }
  const Validation found =
      run.validate({tried_.scalars, tried_.fields.values()},
                   problem_->settings().chosen_validation_spp() * options_.samples);
  if (run.stop_if_dropped()) return false;
  if (tries_ == 0 || found.unbiased < smallest_.unbiased) smallest_ = found;
  if (explains_as_well(found, smallest_)) {
    chosen_ = tried_;
    validation_ = found;
    moved_ = tries_ > 0;
  } else if (is_clearly_worse(found)) {
    ++which_;
    tried_ = chosen_;
  }
  ++tries_;
  if (begin_next()) return true;
  if (!moved_) return false;
  run.point.fields = chosen_.fields.values();
  run.result.fields_last = std::make_shared<FieldValues>(run.point.fields);
  run.accept(chosen_.scalars, validation_, true);
  return false;
}

/// As if each went on to its bound.
double RoughnessProfile::fraction() const {
  if (which_ >= components_.size()) return 1;
  const int k = components_[which_];
  const double way = std::log(problem_->unknowns().maximum()[k] / options_.least);
  const double done =
      way > 0 ? std::clamp(std::log(tried_.scalars[k] / options_.least) / way, 0.0, 1.0) : 1;
  return (static_cast<double>(which_) + done) / static_cast<double>(components_.size());
}

void RoughnessProfile::members(SavedState& state) {
  state(instruments_, components_, which_, chosen_, tried_, smallest_, validation_, pass_, tries_,
        moved_);
}

/// The refined values come first. Where a roughness is determined there is nothing to render.
void RoughnessProfile::plan(RenderPlan& plan) {
  constexpr RoughnessProfileOptions kOptions;
  const double found = plan.count_of(Scale::kRoughness);
  const double tries = found > 0 ? 1 + kExpected.profiled_roughnesses * found : 0;
  plan.add(PhaseKind::kRoughnessProfile, plan.pixels,
           plan.problem.settings().spp * kOptions.light_samples, tries * kOptions.passes,
           Carried::kFieldDerivatives);
  plan.add(PhaseKind::kRoughnessProfile, plan.pixels,
           plan.problem.settings().chosen_validation_spp() * kOptions.samples, tries,
           Carried::kNothing);
}

}  // namespace selenite
