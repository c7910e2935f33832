// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit_job.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "math/error.h"

namespace selenite {

FitJob::FitJob(Scene scene, std::vector<Photo> photos,
               const std::vector<UnknownParameter>& unknowns, FitSettings settings)
    : fit_(std::move(scene), std::move(photos), unknowns, std::move(settings)),
      published_{std::make_shared<const FitResult>(fit_.result()), fit_.previews()} {}

FitJob::~FitJob() {
  cancel();
  join();
}

void FitJob::start() {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_)
    throw InvalidArgument("Fit.start: this fit has been started before; make a new Fit");
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
      if (state_wanted_.exchange(false)) {
        auto saved = std::make_shared<const std::string>(fit_.saved());
        const std::scoped_lock lock(mutex_);
        published_.saved = std::move(saved);
      }
    }
    publish(true);
  } catch (const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    published_.error = error.what();
    end();
  }
}

std::shared_ptr<const std::string> FitJob::take_state() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(published_.saved, nullptr);
}

void FitJob::restore(std::string_view saved, double seconds) {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw InvalidArgument("Fit.restore: this fit has been started; restore a new one");
  fit_.restore(saved);
  published_.result = std::make_shared<const FitResult>(fit_.result());
  clock_.set_seconds_before(seconds);
}

void FitJob::publish(bool over) {
  auto result = std::make_shared<const FitResult>(fit_.result());
  const std::scoped_lock lock(mutex_);
  published_.result = std::move(result);
  published_.previews = fit_.previews();
  clock_.update(*published_.result);
  if (!over) return;
  if (published_.result->stopped == StopReason::kError)
    published_.error = published_.result->message;
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

FitState FitJob::state() const {
  FitState state;
  state.seconds = seconds();
  const std::scoped_lock lock(mutex_);
  const FitResult& result = *published_.result;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  state.running = started_ && !over_;
  state.done = over_;
  state.error = published_.error;
  if (over_) {
    state.stopped_because =
        stop_text(published_.error.empty() ? result.stopped : StopReason::kError);
    if (result.stopped == StopReason::kDropped) state.stopped_because += ": " + result.message;
  }
  state.phase = phase_text(result.phase);
  state.phase_fraction = result.phase_fraction;
  state.iteration = result.iterations;
  state.iterations = fit_.shown_iterations();
  state.loss = result.history.empty() ? kNone : result.history.back().loss;
  state.validation = state.validation_standard_error = kNone;
  for (const HistoryRow& row : result.history) {
    if (row.validation != row.validation) continue;
    state.validation = row.validation;
    state.validation_standard_error = row.validation_standard_error;
  }
  state.seconds_left = over_ ? 0 : started_ ? clock_.seconds_left(result.phase_fraction) : kNone;
  state.values = result.last;
  return state;
}

FitResult FitJob::result() const {
  const std::scoped_lock lock(mutex_);
  return *published_.result;
}

std::shared_ptr<const Picture> FitJob::preview(int photo) const {
  const std::scoped_lock lock(mutex_);
  if (photo < 0 || photo >= static_cast<int>(published_.previews.size()))
    throw InvalidArgument("Fit.preview: photo_index = " + std::to_string(photo) +
                          " must lie in [0, " + std::to_string(published_.previews.size()) + ")");
  return published_.previews[static_cast<std::size_t>(photo)];
}

}  // namespace selenite
