// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/staged_fit.h"

#include <algorithm>

#include "fit/problem/saved_state.h"
#include "fit/run/stage_worker.h"
#include "math/fault.h"
#include "render/shape/shape_gradient.h"

namespace selenite {
namespace {

constexpr const char* kStagesFormat = "stages 2";

/// Whether the next stage may start.
bool ended_well(StopReason reason) {
  switch (reason) {
    case StopReason::kIterations:
    case StopReason::kConverged:
    case StopReason::kTolerance:
      return true;
    case StopReason::kNone:
    case StopReason::kCancelled:
    case StopReason::kDropped:
    case StopReason::kError:
      return false;
  }
  return false;
}

[[noreturn]] void damaged() {
  throw Refused("", "The saved state is damaged or of another version", "start without it");
}

/// A result that was read, against what is fitted: nothing else of it is used without a check.
void check(const FitProblem& problem, const FitResult& result) {
  const Eigen::Index count = problem.unknowns().size();
  bool good = result.best.size() == count && result.last.size() == count && result.fields_best &&
              result.fields_last;
  for (const FieldValues* values : {result.fields_best.get(), result.fields_last.get()})
    good = good && values->size() == problem.fields().names().size();
  for (std::size_t f = 0; good && f < problem.fields().names().size(); ++f)
    good = (*result.fields_best)[f].size() == problem.fields().start()[f].size() &&
           (*result.fields_last)[f].size() == problem.fields().start()[f].size();
  for (const HistoryRow& row : result.history)
    good = good && row.values.size() == count &&
           row.field_means.size() == problem.fields().names().size();
  if (!good) damaged();
}

bool fits_no_shape(const Stage& stage) {
  return std::ranges::none_of(stage.parameters, [](const std::string& name) {
    return name.ends_with(std::string(":") + kVertexPositions);
  });
}

/// Of the step of vertices that a stage before has moved, or whose image is fitted, too: they are
/// almost there.
constexpr double kLaterStep = 0.25;

bool fits_images(const std::vector<Stage>& stages) {
  return std::ranges::any_of(stages, [](const Stage& stage) {
    return std::ranges::any_of(stage.parameters, [](const std::string& name) {
      const std::string parameter = name.substr(name.rfind(':') + 1);
      return is_image_name(parameter) || parameter == kVertexColors;
    });
  });
}

std::vector<Stage> some(std::vector<Stage> stages) {
  if (stages.empty()) throw Refused("Fit", "it has no stage", "give one at least");
  return stages;
}

}  // namespace

StagedFit::StagedFit(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages)
    : stages_(some(std::move(stages))), unknowns_(std::move(unknowns), stages_) {
  RunPoint start = unknowns_.start();
  unknowns_.fill_waiting(start, stages_, 0);
  for (std::size_t i = 1; i < stages_.size(); ++i) (void)fit_of(i, start);
  point_ = std::make_shared<const RunPoint>(std::move(start));
  fit_ = fit_of(0, *point_);
}

/// Later stages go on where others have ended, without a multi-start, unless nothing but vertices was
/// fitted before them; values that others follow need no refinement.
std::unique_ptr<Fit> StagedFit::fit_of(std::size_t stage, const RunPoint& point) const {
  const Stage& one = stages_[stage];
  FitSettings settings = one.settings;
  if (std::any_of(stages_.begin(), stages_.begin() + static_cast<std::ptrdiff_t>(stage),
                  fits_no_shape))
    settings.search = "off";
  if (stage + 1 < stages_.size()) settings.refinement = "off";
  if (settings.workers) settings.workers = workers_of_stage(settings.workers, stage, point);
  std::vector<UnknownParameter> wanted = unknowns_.unknowns_at(one, point);
  if (!fits_no_shape(one) &&
      (fits_images(stages_) ||
       std::any_of(stages_.begin(), stages_.begin() + static_cast<std::ptrdiff_t>(stage),
                   [&](const Stage& other) { return other.parameters == one.parameters; })))
    wanted.front().learning_rate *= kLaterStep;
  return std::make_unique<Fit>(unknowns_.scene_at(one, point), one.photos, std::move(wanted),
                               std::move(settings));
}

bool StagedFit::step(Progress* progress) {
  if (stopped_ != StopReason::kNone) return false;
  if (fit_->step(progress)) return true;
  const StopReason reason = fit_->result().stopped;
  if (!stages_left() || !ended_well(reason)) {
    stopped_ = reason;
    return false;
  }
  if (progress && progress->cancelled) {
    stopped_ = StopReason::kCancelled;
    return false;
  }
  begin_next();
  return true;
}

EndedStage StagedFit::newest() const {
  return {fit_->problem(), std::string(fit_->strategy().method()), fit_->result(), 0};
}

void StagedFit::begin_next() { enter_after(std::make_shared<const EndedStage>(newest())); }

void StagedFit::enter_after(std::shared_ptr<const EndedStage> ended) {
  RunPoint next = *point_;
  next.take(*ended->problem, ended->result.best, *ended->result.fields_best);
  ended_.push_back(std::move(ended));
  unknowns_.fill_waiting(next, stages_, ended_.size());
  point_ = std::make_shared<const RunPoint>(std::move(next));
  fit_ = fit_of(ended_.size(), *point_);
}

void StagedFit::note_seconds(double seconds) {
  EndedStage last = *ended_.back();
  last.seconds = seconds;
  ended_.back() = std::make_shared<const EndedStage>(std::move(last));
}

std::string StagedFit::saved() {
  SavedState state;
  members(state);
  return state.sealed();
}

void StagedFit::restore(std::string_view saved) {
  SavedState state(saved);
  members(state);
  state.expect_end();
}

void StagedFit::members(SavedState& state) {
  std::string format = kStagesFormat;
  state(format);
  if (format != kStagesFormat) damaged();
  auto count = static_cast<std::int64_t>(ended_.size());
  state(count);
  if (count < 0 || count >= static_cast<std::int64_t>(stages_.size()))
    throw Refused("", "The saved state belongs to a run of other stages", "start without it");
  for (std::int64_t i = 0; i < count; ++i) {
    EndedStage ended = state.reading() ? newest() : *ended_[static_cast<std::size_t>(i)];
    state(ended.result, ended.result.stopped, ended.seconds);
    if (!state.reading()) continue;
    check(*ended.problem, ended.result);
    enter_after(std::make_shared<const EndedStage>(std::move(ended)));
  }
  StopReason stopped = stopped_;
  state(*fit_, stopped);
  if (!state.reading() || stopped == StopReason::kCancelled) return;  // it goes on
  stopped_ = stopped;
  fit_->restore_end(stopped);
}

}  // namespace selenite
