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
      published_(std::make_shared<const FitResult>(fit_.result())),
      previews_(fit_.previews()) {}

FitJob::~FitJob() {
  cancel();
  join();
}

void FitJob::start() {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_)
    throw InvalidArgument("Fit.start: this fit has been started before; make a new Fit");
  started_ = true;
  begin_ = Clock::now();
  enter_phase();
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
        saved_ = std::move(saved);
      }
    }
    publish(true);
  } catch (const std::exception& error) {
    const std::scoped_lock lock(mutex_);
    error_ = error.what();
    end_ = Clock::now();
    over_ = true;
  }
}

std::shared_ptr<const std::string> FitJob::take_state() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(saved_, nullptr);
}

void FitJob::restore(std::string_view saved, double seconds) {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw InvalidArgument("Fit.restore: this fit has been started; restore a new one");
  fit_.restore(saved);
  published_ = std::make_shared<const FitResult>(fit_.result());
  seconds_before_ = seconds;
}

void FitJob::publish(bool over) {
  auto result = std::make_shared<const FitResult>(fit_.result());
  const std::scoped_lock lock(mutex_);
  published_ = std::move(result);
  previews_ = fit_.previews();
  if (published_->phase != phase_) enter_phase();
  if (!over) return;
  if (published_->stopped == StopReason::kError) error_ = published_->message;
  end_ = Clock::now();
  over_ = true;
}

void FitJob::enter_phase() {
  phase_ = published_->phase;
  phase_begin_ = Clock::now();
  phase_from_ = published_->iterations;
}

double FitJob::seconds_left() const {
  const FitResult& result = *published_;
  const double done = phase_ == PhaseKind::kDescent
                          ? static_cast<double>(result.iterations - phase_from_) /
                                (fit_.all_iterations() - phase_from_)
                          : result.phase_fraction;
  if (!(done > 0)) return std::numeric_limits<double>::quiet_NaN();
  const std::chrono::duration<double> taken = Clock::now() - phase_begin_;
  return taken.count() * std::max(1 - done, 0.0) / done;
}

double FitJob::seconds() const {
  const std::scoped_lock lock(mutex_);
  if (!started_) return seconds_before_;
  return seconds_before_ +
         std::chrono::duration<double>((over_ ? end_ : Clock::now()) - begin_).count();
}

FitState FitJob::state() const {
  FitState state;
  state.seconds = seconds();
  const std::scoped_lock lock(mutex_);
  const FitResult& result = *published_;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  state.running = started_ && !over_;
  state.done = over_;
  state.error = error_;
  if (over_) {
    state.stopped_because = stop_text(error_.empty() ? result.stopped : StopReason::kError);
    if (result.stopped == StopReason::kDropped) state.stopped_because += ": " + result.message;
  }
  state.phase = phase_text(result.phase);
  state.phase_fraction = result.phase_fraction;
  state.iteration = result.iterations;
  state.iterations = fit_.all_iterations();
  state.loss = result.history.empty() ? kNone : result.history.back().loss;
  state.validation = state.validation_standard_error = kNone;
  for (const HistoryRow& row : result.history) {
    if (row.validation != row.validation) continue;
    state.validation = row.validation;
    state.validation_standard_error = row.validation_standard_error;
  }
  state.seconds_left = over_ ? 0 : started_ ? seconds_left() : kNone;
  state.values = result.last;
  return state;
}

FitResult FitJob::result() const {
  const std::scoped_lock lock(mutex_);
  return *published_;
}

std::shared_ptr<const Picture> FitJob::preview(int photo) const {
  const std::scoped_lock lock(mutex_);
  if (photo < 0 || photo >= static_cast<int>(previews_.size()))
    throw InvalidArgument("Fit.preview: photo_index = " + std::to_string(photo) +
                          " must lie in [0, " + std::to_string(previews_.size()) + ")");
  return previews_[static_cast<std::size_t>(photo)];
}

}  // namespace selenite
