// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/parts/parts_phase.h"

#include <algorithm>
#include <utility>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

constexpr int kLearning = 400;  ///< purpose of seeds, beside those of a refinement

SceneModel model_of(const FitRun& run, const Problem& problem) {
  const SceneModel whole = scene_model(run.problem);
  return {problem, whole.differences, whole.scene_at};
}

}  // namespace

PartsPhase::Part::Part(FitRun& run, std::vector<Photo> some)
    : photos(std::move(some)),
      problem{run.problem.scalars().unknowns,
              run.problem.scalars().layout,
              photos,
              run.problem.scalars().loss,
              run.problem.scalars().iterations,
              std::make_shared<PhotoWeights>(photos, run.problem.loss().weighted)},
      evaluator(model_of(run, problem), run.problem.settings(), run.result) {
  evaluator.take_alignments(run.evaluator);
}

std::unique_ptr<PartsPhase> PartsPhase::of(FitRun& run, const std::vector<AbsentWeight>& absent) {
  const TrustReport& report = run.result.report;
  const bool none =
      std::ranges::none_of(report.components, [](const Confidence& one) { return one.determined; });
  if (none || report.misfit.explained || run.problem.photos().size() < 2) return nullptr;
  auto phase = std::make_unique<PartsPhase>(run);
  phase->absent_ = absent;
  phase->begin_part();
  return phase;
}

PartsPhase::PartsPhase(FitRun& run) : run_(&run), at_{run.result.best, *run.result.fields_best} {}

std::size_t PartsPhase::count() const {
  return std::clamp<std::size_t>(run_->problem.photos().size() / options_.photos, 2, options_.most);
}

int PartsPhase::spp() const {
  const int whole = run_->problem.settings().chosen_refinement_spp();
  return std::max(whole / options_.share, RefinementOptions{}.least_of_pass);
}

std::uint64_t PartsPhase::seed() const {
  return stream_seed(run_->problem.settings().seed, Stream::kParts, static_cast<int>(done_.size()),
                     part_->round);
}

void PartsPhase::begin_part() {
  const std::vector<Photo>& all = run_->problem.photos();
  std::vector<Photo> photos;
  for (std::size_t i = done_.size(); i < all.size(); i += count()) photos.push_back(all[i]);
  part_ = std::make_unique<Part>(*run_, std::move(photos));
  begin_round(at_.scalars);
}

void PartsPhase::begin_round(const Vector& x) {
  const FitSettings& settings = run_->problem.settings();
  part_->refinement =
      std::make_unique<Refinement>(part_->problem, nullptr, Point{x, at_.fields}, seed(), spp(),
                                   settings.spp, RefinementOptions{.most_passes = options_.passes});
  part_->refinement->hold(absent_);
}

void PartsPhase::learn(const Vector& x) {
  std::vector<Observation> seen;
  const Point at{x, at_.fields};
  const std::vector<Photo>& photos = part_->photos;
  const auto how = [&](std::size_t i) {
    return Evaluation{spp(), seed_of(seed(), kLearning, static_cast<int>(i))};
  };
  Ahead ahead;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    ahead.reach(part_->evaluator, i, photos.size(),
                [&](std::size_t k) { part_->evaluator.expect(at, photos[k], how(k)); });
    seen.push_back({static_cast<int>(i), part_->evaluator.evaluate(at, photos[i], how(i)), {}});
  }
  PhotoWeights& weights = *part_->problem.weights;
  weights.learn(seen, 0, 1);
  weights.weigh_answer();
}

bool PartsPhase::step(FitRun& run) {
  part_->evaluator.watch(run.evaluator.progress());
  part_->refinement->watch(run.evaluator.progress());
  const bool more = part_->refinement->step(part_->evaluator);
  if (run.stop_if_dropped()) return false;
  if (more) return true;
  const Vector x = part_->refinement->values();
  if (++part_->round < options_.rounds) {
    learn(x);
    begin_round(x);
    return true;
  }
  done_.push_back({x, part_->refinement->report().components});
  if (done_.size() < count()) {
    begin_part();
    return true;
  }
  const Unknowns& unknowns = run.problem.unknowns();
  widen_by_parts(unknowns, Reparametrization(unknowns), at_.scalars, done_, run.result.report);
  return false;
}

double PartsPhase::fraction() const {
  const double rounds = options_.rounds;
  const double part =
      done_.size() < count() ? (part_->round + part_->refinement->fraction()) / rounds : 0;
  return (static_cast<double>(done_.size()) + part) / static_cast<double>(count());
}

void PartsPhase::members(SavedState& state) {
  state(absent_, done_);
  if (state.reading()) begin_part();
  state(part_->round, *part_->problem.weights, part_->evaluator);
  if (state.reading()) begin_round(at_.scalars);
  state(*part_->refinement);
}

}  // namespace selenite
