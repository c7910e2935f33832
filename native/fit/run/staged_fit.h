// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "fit/run/fit.h"
#include "fit/run/stage.h"

namespace selenite {

/// Fits in stages, in the caller's thread: each starts at the best values of the one before it. One
/// stage alone is a fit like any other.
class StagedFit {
 public:
  /// Checks every stage and starts none. `unknowns`: of the run; each stage fits some of them.
  /// InvalidArgument, UnknownName: see Fit; no stage.
  StagedFit(std::vector<UnknownParameter> unknowns, std::vector<Stage> stages);

  /// A step of the present fit, or the beginning of the next stage. False when the run is over.
  bool step(Progress* progress = nullptr);
  /// The whole state, see Fit.
  std::string saved();
  void restore(std::string_view saved);
  /// The same of a state elsewhere.
  void members(SavedState& state);

  const std::vector<Stage>& stages() const { return stages_; }
  const RunUnknowns& unknowns() const { return unknowns_; }
  const std::vector<std::shared_ptr<const EndedStage>>& ended() const { return ended_; }
  /// Of the present stage.
  const Fit& fit() const { return *fit_; }
  /// Where the present stage has started.
  const std::shared_ptr<const RunPoint>& point() const { return point_; }
  StopReason stopped() const { return stopped_; }
  /// Of the stage that has ended last: this class has no clock.
  void note_seconds(double seconds);

 private:
  std::unique_ptr<Fit> fit_of(std::size_t stage, const RunPoint& point) const;
  /// The present stage as it stands.
  EndedStage newest() const;
  void begin_next();
  void enter_after(std::shared_ptr<const EndedStage> ended);
  bool stages_left() const { return ended_.size() + 1 < stages_.size(); }

  std::vector<Stage> stages_;
  RunUnknowns unknowns_;
  std::shared_ptr<const RunPoint> point_;
  std::vector<std::shared_ptr<const EndedStage>> ended_;
  std::unique_ptr<Fit> fit_;
  StopReason stopped_ = StopReason::kNone;
};

}  // namespace selenite
