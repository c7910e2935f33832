// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/parts/parts_phase.h"

#include <algorithm>

#include "fit/evaluate/seeds.h"

namespace selenite {

std::unique_ptr<PartsPhase> PartsPhase::of(const FitRun& run,
                                           const std::vector<AbsentWeight>& absent) {
  const TrustReport& report = run.result.report;
  const bool none =
      std::ranges::none_of(report.components, [](const Confidence& one) { return one.determined; });
  if (none || report.misfit.explained || run.problem.photos().size() < 2) return nullptr;
  auto phase = std::make_unique<PartsPhase>(run);
  phase->absent_ = absent;
  phase->begin_part();
  return phase;
}

PartsPhase::PartsPhase(const FitRun& run)
    : problem_(&run.problem), at_{run.result.best, *run.result.fields_best} {}

std::size_t PartsPhase::count() const {
  return std::clamp<std::size_t>(problem_->photos().size() / options_.photos, 2, options_.most);
}

void PartsPhase::begin_part() {
  const FitSettings& settings = problem_->settings();
  std::vector<std::size_t> photos;
  for (std::size_t i = done_.size(); i < problem_->photos().size(); i += count())
    photos.push_back(i);
  refinement_ = std::make_unique<Refinement>(
      problem_->scalars(), nullptr, at_,
      stream_seed(settings.seed, Stream::kParts, static_cast<int>(done_.size()), 0),
      std::max(settings.chosen_refinement_spp() / options_.share,
               RefinementOptions{}.least_of_pass),
      settings.spp, RefinementOptions{.most_passes = options_.passes, .photos = std::move(photos)});
  refinement_->hold(absent_);
}

bool PartsPhase::step(FitRun& run) {
  refinement_->watch(run.evaluator.progress());
  const bool more = refinement_->step(run.evaluator);
  if (run.stop_if_dropped()) return false;
  if (more) return true;
  PartAnswer found{refinement_->values(), {}};
  for (const Confidence& one : refinement_->report().components)
    found.determined.push_back(one.determined);
  done_.push_back(std::move(found));
  if (done_.size() < count()) {
    begin_part();
    return true;
  }
  const Unknowns& unknowns = problem_->unknowns();
  widen_by_parts(unknowns, Reparametrization(unknowns), at_.scalars, done_, run.result.report);
  return false;
}

double PartsPhase::fraction() const {
  const double part = done_.size() < count() ? refinement_->fraction() : 0;
  return (static_cast<double>(done_.size()) + part) / static_cast<double>(count());
}

void PartsPhase::members(SavedState& state) {
  state(absent_, done_);
  if (state.reading()) begin_part();
  state(*refinement_);
}

}  // namespace selenite
