// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/shape_job.h"

#include <limits>
#include <utility>

#include "fit/run/failure.h"

namespace selenite {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

ShapeJob::ShapeJob(Scene scene, std::vector<Photo> photos, UnknownVertices unknown,
                   FitSettings settings)
    : fit_(std::move(scene), std::move(photos), std::move(unknown), std::move(settings)),
      result_(std::make_shared<const ShapeResult>(fit_.result())),
      previews_(fit_.previews()) {}

ShapeJob::~ShapeJob() {
  cancel();
  join();
}

void ShapeJob::start() {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw Refused("Fit.start", "this fit has been started before", "make a new Fit");
  started_ = true;
  begin_ = std::chrono::steady_clock::now();
  first_iteration_ = result_->iterations;
  thread_ = std::thread([this] { run(); });
}

void ShapeJob::join() {
  const std::scoped_lock lock(join_mutex_);
  if (thread_.joinable()) thread_.join();
}

void ShapeJob::run() {
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
  } catch (const Cancelled&) {
    fit_.stop(StopReason::kCancelled);
    publish(true);
  } catch (const std::exception& error) {
    {
      const std::scoped_lock lock(mutex_);
      faults_ = failure(error, "Fit");
    }
    fit_.stop(StopReason::kError);
    publish(true);
  }
}

void ShapeJob::publish(bool over) {
  auto fresh = std::make_shared<const ShapeResult>(fit_.result());
  const std::scoped_lock lock(mutex_);
  result_ = std::move(fresh);
  previews_ = fit_.previews();
  stopped_ = fit_.stopped();
  seconds_ = seconds_before_ + since(begin_);
  over_ = over;
}

void ShapeJob::request_state() {
  const std::scoped_lock lock(mutex_);
  if (over_)  // the thread has left the fit
    saved_ = std::make_shared<const std::string>(fit_.saved());
  else
    state_wanted_ = true;
}

std::shared_ptr<const std::string> ShapeJob::take_state() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(saved_, nullptr);
}

void ShapeJob::restore(std::string_view saved, double seconds) {
  const std::scoped_lock lock(join_mutex_, mutex_);
  if (started_) throw Refused("Fit.restore", "this fit has been started", "restore a new one");
  fit_.restore(saved);
  result_ = std::make_shared<const ShapeResult>(fit_.result());
  seconds_ = seconds_before_ = seconds;
}

ShapeState ShapeJob::state() const {
  const std::scoped_lock lock(mutex_);
  ShapeState state;
  state.running = started_ && !over_;
  state.done = over_;
  state.faults = faults_;
  state.stopped = over_ ? stopped_ : StopReason::kNone;
  state.iteration = result_->iterations;
  state.iterations = fit_.settings().iterations;
  state.loss = result_->history.empty() ? kNone : result_->history.back().loss;
  const double here = started_ && !over_ ? since(begin_) : seconds_ - seconds_before_;
  state.seconds = seconds_before_ + here;
  const int done = state.iteration - first_iteration_;
  state.seconds_left = over_      ? 0
                       : done > 0 ? here / done * (state.iterations - state.iteration)
                                  : kNone;
  return state;
}

std::shared_ptr<const ShapeResult> ShapeJob::result() const {
  const std::scoped_lock lock(mutex_);
  return result_;
}

std::shared_ptr<const Picture> ShapeJob::preview(int photo) const {
  const std::scoped_lock lock(mutex_);
  if (photo < 0 || photo >= static_cast<int>(previews_.size()))
    throw Refused("Fit.preview", "photo_index = " + std::to_string(photo) + " must lie in [0, " +
                                     std::to_string(previews_.size()) + ")");
  return previews_[static_cast<std::size_t>(photo)];
}

}  // namespace selenite
