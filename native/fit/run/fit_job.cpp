// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit_job.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <system_error>
#include <utility>

#include "fit/problem/saved_state.h"
#include "fit/run/failure.h"

namespace selenite {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<Stage> one_stage(Scene scene, std::vector<Photo> photos,
                             const std::vector<UnknownParameter>& unknowns, FitSettings settings) {
  std::vector<Stage> stages(1);
  for (const UnknownParameter& one : unknowns) {
    stages[0].parameters.push_back(one.name());
    if (Fields::is_field(one)) stages[0].fields.push_back(stages[0].parameters.back());
  }
  stages[0].scene = std::move(scene);
  stages[0].photos = std::move(photos);
  stages[0].settings = std::move(settings);
  return stages;
}

WrittenState written(const std::filesystem::path& file, StagedFit& fit) {
  const auto begin = std::chrono::steady_clock::now();
  std::error_code trouble;
  try {
    SavedState::write(file, fit);
  } catch (const std::system_error& error) {
    trouble = error.code();
  }
  return {file, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
          trouble};
}

}  // namespace

FitJob::FitJob(Scene scene, std::vector<Photo> photos,
               const std::vector<UnknownParameter>& unknowns, FitSettings settings)
    : FitJob(unknowns,
             one_stage(std::move(scene), std::move(photos), unknowns, std::move(settings))) {}

FitJob::FitJob(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages)
    : fit_(std::move(unknowns), std::move(stages)), published_(published()) {}

FitJob::Published FitJob::published() const {
  const Fit& fit = fit_.fit();
  return {fit_.ended(),
          fit_.point(),
          fit.problem(),
          std::string(fit.strategy().method()),
          std::make_shared<const FitResult>(fit.result()),
          fit.shown_iterations(fit.result().iterations),
          fit_.stopped(),
          fit.previews(),
          fit.faults()};
}

FitJob::~FitJob() {
  cancel();
  join();
}

void FitJob::start() {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw Refused("Fit.start", "this fit has been started before", "make a new Fit");
  started_ = true;
  clock_.start(*published_.result);
  thread_ = std::thread([this] { run(); });
}

void FitJob::join() {
  const std::scoped_lock lock(join_mutex_);  // two threads may wait for the same fit
  if (thread_.joinable()) thread_.join();
}

/// No exception leaves the thread: it would end the whole program, Blender and the user's scene
/// with it.
void FitJob::run() {
  try {
    while (fit_.step(&progress_)) {
      publish(false);
      write_state();
    }
    publish(true);
  } catch (const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    published_.faults = failure(error, "Fit");
    end();
  }
}

void FitJob::write_state() {
  std::optional<std::filesystem::path> file;
  {
    const std::scoped_lock lock(mutex_);
    file = std::exchange(state_wanted_, std::nullopt);
  }
  if (!file) return;
  WrittenState state = written(*file, fit_);
  const std::scoped_lock lock(mutex_);
  state_written_ = std::move(state);
}

void FitJob::request_state(const std::filesystem::path& file) {
  const std::scoped_lock lock(mutex_);
  if (over_)  // the thread has left the fit
    state_written_ = written(file, fit_);
  else
    state_wanted_ = file;
}

std::optional<WrittenState> FitJob::take_state() {
  const std::scoped_lock lock(mutex_);
  std::optional<WrittenState> state = std::exchange(state_written_, std::nullopt);
  if (state && state->trouble) throw std::system_error(state->trouble);
  return state;
}

void FitJob::restore(const std::filesystem::path& file, double seconds) {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw Refused("Fit.restore", "this fit has been started", "restore a new one");
  SavedState::read(file, fit_);
  published_ = published();
  stages_noted_ = fit_.ended().size();
  clock_.set_seconds_before(seconds);
}

void FitJob::publish(bool over) {
  const bool next_stage = fit_.ended().size() > stages_noted_;
  if (next_stage) {
    fit_.note_seconds(stage_seconds());
    stages_noted_ = fit_.ended().size();
  }
  Published fresh = published();
  const std::scoped_lock lock(mutex_);
  published_ = std::move(fresh);
  clock_.update(*published_.result, next_stage);
  if (!over) return;
  end();
}

void FitJob::end() {
  clock_.stop();
  over_ = true;
}

double FitJob::seconds() const {
  const std::scoped_lock lock(mutex_);
  return clock_.seconds();
}

double FitJob::seconds_before() const {
  double sum = 0;
  for (const auto& one : published_.ended) sum += one->seconds;
  return sum;
}

double FitJob::stage_seconds() const {
  const std::scoped_lock lock(mutex_);
  return clock_.seconds() - seconds_before();
}

/// By the paths of their iterations, at the pace of the stage that runs; NaN before its first one.
double FitJob::seconds_of_later_stages() const {
  const auto paths = [](const Stage& stage) {
    double pixels = 0;
    for (const Photo& photo : stage.photos) pixels += static_cast<double>(photo.size());
    return pixels * stage.settings.spp;
  };
  const std::size_t now = published_.ended.size();
  double later = 0;
  for (std::size_t i = now + 1; i < stages().size(); ++i)
    later += stages()[i].settings.iterations * paths(stages()[i]);
  if (later == 0) return 0;
  const int done = published_.result->iterations;
  if (done == 0) return kNone;
  return (clock_.seconds() - seconds_before()) / done / paths(stages()[now]) * later;
}

FitState FitJob::state() const {
  FitState state;
  const std::scoped_lock lock(mutex_);
  const FitResult& result = *published_.result;
  state.seconds = clock_.seconds();
  state.running = started_ && !over_;
  state.done = over_;
  state.faults = published_.faults;
  if (over_) state.stopped = published_.faults.empty() ? published_.stopped : StopReason::kError;
  state.message = result.message;
  state.phase = result.phase;
  state.phase_fraction = result.phase_fraction;
  state.stage = published_.ended.size();
  state.own_iteration = state.iteration = result.iterations;
  state.iterations = published_.iterations;
  for (const auto& one : published_.ended) {
    state.iteration += one->result.iterations;
    state.iterations += one->result.iterations;
  }
  for (std::size_t i = state.stage + 1; i < stages().size(); ++i)
    state.iterations += stages()[i].settings.iterations;
  state.loss = result.history.empty() ? kNone : result.history.back().loss;
  state.validation = state.validation_standard_error = kNone;
  for (const HistoryRow& row : result.history) {
    if (row.validation != row.validation) continue;
    state.validation = row.validation;
    state.validation_standard_error = row.validation_standard_error;
  }
  state.seconds_left = over_ ? 0
                       : started_
                           ? clock_.seconds_left(result.phase_fraction) + seconds_of_later_stages()
                           : kNone;
  state.values.scalars = published_.point->scalars;
  state.values.take(*published_.problem, result.last, {});
  return state;
}

RunResult FitJob::result() const {
  const std::scoped_lock lock(mutex_);
  return {published_.ended,
          published_.point,
          {published_.problem, published_.optimiser, *published_.result,
           clock_.seconds() - seconds_before()}};
}

std::shared_ptr<const Picture> FitJob::preview(int photo) const {
  const std::scoped_lock lock(mutex_);
  if (photo < 0 || photo >= static_cast<int>(published_.previews.size()))
    throw Refused("Fit.preview", "photo_index = " + std::to_string(photo) + " must lie in [0, " +
                                     std::to_string(published_.previews.size()) + ")");
  return published_.previews[static_cast<std::size_t>(photo)];
}

}  // namespace selenite
