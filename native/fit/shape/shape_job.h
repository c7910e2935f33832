// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "fit/shape/shape_fit.h"
#include "math/fault.h"

namespace selenite {

/// What a running descent of vertices reports.
struct ShapeState {
  bool running = false, done = false;
  std::vector<Fault> faults;  ///< why it failed; empty if it did not
  StopReason stopped = StopReason::kNone;
  int iteration = 0, iterations = 0;
  double loss = 0;  ///< newest; NaN: none yet
  double seconds = 0;
  double seconds_left = 0;  ///< NaN: not known yet
};

/// A ShapeFit in a thread of its own; see FitJob.
class ShapeJob {
 public:
  ShapeJob(Scene scene, std::vector<Photo> photos, UnknownVertices unknown, FitSettings settings);
  ~ShapeJob();
  ShapeJob(const ShapeJob&) = delete;
  ShapeJob& operator=(const ShapeJob&) = delete;

  void start();
  void cancel() { progress_.cancelled = true; }
  void join();
  void request_state();
  std::shared_ptr<const std::string> take_state();
  void restore(std::string_view saved, double seconds);

  ShapeState state() const;
  std::shared_ptr<const ShapeResult> result() const;
  std::shared_ptr<const Picture> preview(int photo) const;
  const std::vector<Photo>& photos() const { return fit_.photos(); }
  const UnknownVertices& unknown() const { return fit_.unknown(); }

 private:
  void run();
  void publish(bool over);

  ShapeFit fit_;  ///< touched by the thread alone once it runs
  Progress progress_;
  std::atomic<bool> state_wanted_{false};
  mutable std::mutex mutex_;  ///< guards all below
  bool started_ = false, over_ = false;
  double seconds_before_ = 0, seconds_ = 0;
  int first_iteration_ = 0;
  std::chrono::steady_clock::time_point begin_;
  std::shared_ptr<const ShapeResult> result_;
  StopReason stopped_ = StopReason::kNone;
  std::vector<std::shared_ptr<const Picture>> previews_;
  std::shared_ptr<const std::string> saved_;
  std::vector<Fault> faults_;
  std::mutex join_mutex_;
  std::thread thread_;
};

}  // namespace selenite
