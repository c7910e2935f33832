// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "fit/run/fit.h"
#include "fit/run/fit_clock.h"

namespace selenite {

/// What a running fit tells at any time.
struct FitState {
  bool running = false, done = false;
  std::string error;            ///< why it failed; empty if it did not
  std::string stopped_because;  ///< empty while running
  std::string phase;            ///< see `phase_text`
  double phase_fraction = 0;    ///< of the phase
  int iteration = 0, iterations = 0;
  double loss = 0, validation = 0, validation_standard_error = 0;  ///< newest; NaN: none yet
  double seconds = 0;
  double seconds_left = 0;  ///< of the phase, from its own pace; NaN: not known yet
  Vector values;
};

/// A fit in a thread of its own. Every member may be called from any thread; none waits for a
/// render except `join` and the destructor (which cancels first: at most a tile).
class FitJob {
 public:
  /// Checks everything (see Fit), starts nothing.
  FitJob(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
         FitSettings settings);
  ~FitJob();
  FitJob(const FitJob&) = delete;
  FitJob& operator=(const FitJob&) = delete;

  /// InvalidArgument when it has been started before.
  void start();
  /// Polled per tile; what has been found so far stays.
  void cancel() { progress_.cancelled = true; }
  void join();
  /// Asks for the state after the iteration that runs; `take_state` has it then, once.
  void request_state() { state_wanted_ = true; }
  /// See Fit::saved; empty until it is there.
  std::shared_ptr<const std::string> take_state();
  /// Before `start`: goes on from a state that had taken so many seconds. Throws as Fit::restore.
  void restore(std::string_view saved, double seconds);

  FitState state() const;
  FitResult result() const;
  /// Seconds from start to end, or to now.
  double seconds() const;
  /// Newest picture; empty before the first. InvalidArgument when there is no such photo.
  std::shared_ptr<const Picture> preview(int photo) const;

  const Unknowns& unknowns() const { return fit_.unknowns(); }
  const Fields& fields() const { return fit_.fields(); }
  const std::vector<Photo>& photos() const { return fit_.photos(); }
  std::string optimiser_name() const { return std::string(fit_.strategy().optimiser.name); }

 private:
  /// What the thread has published; readers see nothing else of the fit.
  struct Published {
    std::shared_ptr<const FitResult> result;
    Previews previews{};
    std::shared_ptr<const std::string> saved{};
    std::string error{};  ///< why it failed; empty if it did not
  };
  void run();
  void publish(bool over);
  void end();

  Fit fit_;  ///< touched by the thread alone once it runs
  Progress progress_;
  std::atomic<bool> state_wanted_{false};
  mutable std::mutex mutex_;  ///< guards all below
  bool started_ = false, over_ = false;
  FitClock clock_;
  Published published_;
  std::mutex join_mutex_;
  std::thread thread_;
};

}  // namespace selenite
