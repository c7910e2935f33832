// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "fit/run/fit_clock.h"
#include "fit/run/staged_fit.h"

namespace selenite {

/// What a running fit reports.
struct FitState {
  bool running = false, done = false;
  std::vector<Fault> faults;  ///< why it failed; empty if it did not
  StopReason stopped = StopReason::kNone;
  std::string message;  ///< why, where `stopped` does not say it all
  PhaseKind phase = PhaseKind::kDescent;
  double phase_fraction = 0;  ///< of the phase
  std::size_t stage = 0;
  int iteration = 0, iterations = 0;                               ///< of all stages
  int own_iteration = 0;                                           ///< of the stage
  double loss = 0, validation = 0, validation_standard_error = 0;  ///< newest; NaN: none yet
  double seconds = 0;
  double seconds_left = 0;  ///< of the phase, and of later stages at its pace; NaN: not known yet
  RunPoint values;          ///< without fields
};

/// What a run has found so far: shared, never changed afterwards.
struct RunResult {
  std::vector<std::shared_ptr<const EndedStage>> ended;
  std::shared_ptr<const RunPoint> point;  ///< where the newest stage started
  EndedStage newest;                      ///< whether it has ended or not
};

/// A file with the whole state of a fit, see Fit::saved.
struct WrittenState {
  std::filesystem::path file;
  double seconds;           ///< that it took
  std::error_code trouble;  ///< why it is not there
};

/// A fit in a thread of its own. Every member may be called from any thread; none waits for a
/// render except `join` and the destructor (which cancels first: at most a tile).
class FitJob {
 public:
  /// Checks everything (see Fit), starts nothing.
  FitJob(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
         FitSettings settings);
  /// In stages, see StagedFit.
  FitJob(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages);
  ~FitJob();
  FitJob(const FitJob&) = delete;
  FitJob& operator=(const FitJob&) = delete;

  /// InvalidArgument when it has been started before.
  void start();
  /// Polled per tile; what has been found so far stays.
  void cancel() { progress_.cancelled = true; }
  void join();
  /// Asks for the state in a file after the iteration that runs, or now of a fit that is over. A file that
  /// was asked for before and is not there yet will not be.
  void request_state(const std::filesystem::path& file);
  /// The newest state that has been written since the last call, once. Throws std::system_error where it
  /// could not be: the fit goes on.
  std::optional<WrittenState> take_state();
  /// Before `start`: goes on from a state that had taken so many seconds. Throws as Fit::restore, and
  /// std::system_error.
  void restore(const std::filesystem::path& file, double seconds);

  FitState state() const;
  RunResult result() const;
  /// Seconds from start to end, or to now.
  double seconds() const;
  /// Newest picture of the stage that runs; empty before the first. InvalidArgument when there is no
  /// such photo.
  std::shared_ptr<const Picture> preview(int photo) const;
  const std::vector<Stage>& stages() const { return fit_.stages(); }
  const RunUnknowns& unknowns() const { return fit_.unknowns(); }

 private:
  /// What the thread has published; readers see nothing else of the fit.
  struct Published {
    std::vector<std::shared_ptr<const EndedStage>> ended{};
    std::shared_ptr<const RunPoint> point;
    std::shared_ptr<const FitProblem> problem;
    std::string optimiser;
    std::shared_ptr<const FitResult> result;
    int iterations = 0;  ///< of the stage that runs, as shown
    StopReason stopped = StopReason::kNone;
    Previews previews{};
    std::vector<Fault> faults{};  ///< why it failed; empty if it did not
  };
  /// From the fit, which no thread touches meanwhile.
  Published published() const;
  /// Of the stages that have ended. `mutex_` is held.
  double seconds_before() const;
  double seconds_of_later_stages() const;
  /// Of the stage that runs.
  double stage_seconds() const;
  void run();
  void publish(bool over);
  void end();
  /// Writes the state if it was asked for.
  void write_state();

  std::size_t stages_noted_ = 0;  ///< ended ones whose time is known; touched as `fit_`
  StagedFit fit_;                 ///< touched by the thread alone once it runs
  Progress progress_;
  mutable std::mutex mutex_;  ///< guards all below
  std::optional<std::filesystem::path> state_wanted_;
  std::optional<WrittenState> state_written_;
  bool started_ = false, over_ = false;
  FitClock clock_;
  Published published_;
  std::mutex join_mutex_;
  std::thread thread_;
};

}  // namespace selenite
