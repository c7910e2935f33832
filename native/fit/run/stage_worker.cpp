// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/stage_worker.h"

#include <utility>

#include "fit/evaluate/headed_bytes.h"
#include "fit/evaluate/photo_evaluator.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

template <class Values>
void members_of(std::vector<std::pair<std::string, Values>>& named, SavedState& state) {
  std::vector<std::string> names;
  std::vector<Values> values;
  for (const auto& [name, value] : named) {
    names.push_back(name);
    values.push_back(value);
  }
  state(names, values);
  if (!state.reading()) return;
  if (names.size() != values.size())
    throw Refused("", "A message between a fit and its workers is damaged", "");
  named.clear();
  for (std::size_t i = 0; i < names.size(); ++i)
    named.emplace_back(std::move(names[i]), std::move(values[i]));
}

struct StageStart {
  std::uint64_t stage = 0;
  RunPoint point;
  void members(SavedState& state) {
    state(stage);
    members_of(point.scalars, state);
    members_of(point.fields, state);
  }
};

class WorkersOfStage final : public RenderWorkers {
 public:
  WorkersOfStage(std::shared_ptr<RenderWorkers> workers, StageStart start)
      : workers_(std::move(workers)) {
    SavedState state;
    start.members(state);
    where_ = state.sealed();
  }
  std::int64_t ask(const std::string& question, double work) override {
    return workers_->ask(headed(where_, question), work);
  }
  std::string answer(std::int64_t number, const Progress* progress) override {
    return workers_->answer(number, progress);
  }
  void forget(std::int64_t number) override { workers_->forget(number); }
  int busy_with() const override { return workers_->busy_with(); }

 private:
  std::shared_ptr<RenderWorkers> workers_;
  std::string where_;
};

}  // namespace

std::shared_ptr<RenderWorkers> workers_of_stage(std::shared_ptr<RenderWorkers> workers,
                                                std::size_t stage, RunPoint point) {
  return std::make_shared<WorkersOfStage>(std::move(workers), StageStart{stage, std::move(point)});
}

StageWorker::StageWorker(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages,
                         int threads)
    : stages_(std::move(stages)), unknowns_(std::move(unknowns), stages_), threads_(threads) {}

std::shared_ptr<const FitProblem> StageWorker::begun(std::string_view where) {
  const std::scoped_lock lock(mutex_);
  if (newest_.problem && newest_.where == where) return newest_.problem;
  SavedState state(where);
  StageStart start;
  start.members(state);
  state.expect_end();
  if (start.stage >= stages_.size())
    throw Refused("",
                  "A question is about stage " + std::to_string(start.stage + 1) + " of " +
                      std::to_string(stages_.size()),
                  "");
  const Stage& stage = stages_[start.stage];
  FitSettings settings = stage.settings;
  settings.threads = threads_;
  newest_ = {std::string(where), std::make_shared<const FitProblem>(
                                     unknowns_.scene_at(stage, start.point), stage.photos,
                                     unknowns_.unknowns_at(stage, start.point), settings)};
  return newest_.problem;
}

std::string StageWorker::answer(std::string_view question) {
  const auto problem = begun(take_head(question));
  const PhotoQuestion asked = PhotoQuestion::of(question);
  RenderCounts counts;
  PhotoEvaluator evaluator(scene_model(*problem), problem->settings(), counts);
  Film film = evaluator.answer(asked);
  return PhotoAnswer{std::move(film), counts}.bytes(asked.pixels.get());
}

}  // namespace selenite
