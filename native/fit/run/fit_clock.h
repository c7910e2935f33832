// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <chrono>
#include <limits>

#include "fit/state/fit_result.h"

namespace selenite {

/// The time that a fit and its present phase have taken.
class FitClock {
 public:
  /// Seconds of the fit that this one resumes.
  void set_seconds_before(double seconds) { before_ = seconds; }
  void start(const FitResult& result) {
    begin_ = Clock::now();
    running_ = true;
    enter_phase(result);
  }
  void stop() {
    before_ = seconds();
    running_ = false;
  }
  /// Notes where a new stage, or by the result a new phase, has begun.
  void update(const FitResult& result, bool next_stage) {
    if (next_stage || result.phase != phase_) enter_phase(result);
  }
  double seconds() const { return before_ + (running_ ? since(begin_) : 0); }
  /// Of the phase, from its own pace; NaN: not known yet. `done`: share of the phase.
  double seconds_left(double done) const {
    const double here = done - done_before_;
    if (!(here > 0)) return std::numeric_limits<double>::quiet_NaN();
    return since(phase_begin_) * std::max(1 - done, 0.0) / here;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static double since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }
  void enter_phase(const FitResult& result) {
    phase_ = result.phase;
    phase_begin_ = Clock::now();
    done_before_ = result.phase_fraction;
  }

  bool running_ = false;
  double before_ = 0;
  Clock::time_point begin_, phase_begin_;
  PhaseKind phase_ = PhaseKind::kDescent;
  double done_before_ = 0;  ///< share of the phase that was done when this clock first saw it
};

}  // namespace selenite
