// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "fit/phases/ior_line_search.h"

namespace selenite {

/// Before a block of scalars and after the last one: compares the values with the same at low roughness,
/// each after a line search for the IOR. Fields beside a rough body take on the details that it lacks, so
/// that the way back by steps is long.
class LowRoughnessRestart {
 public:
  explicit LowRoughnessRestart(const FitRun& run) : ior_(run) {}

  /// Begins a comparison where one is due: `first`: before the first block of scalars, then only where
  /// an IOR is searched, as hardly anything else separates the two while texels or voxels are nearly
  /// alike. False where there is nothing to compare, or what was found has not been used yet.
  bool begin(const FitRun& run, bool first);
  bool running() const { return !candidates_.empty(); }
  /// Evaluates the next candidate; after the last one moves `run.point` to the better. True while there
  /// are more.
  bool step(FitRun& run);
  /// Whether the last comparison moved to low roughness.
  bool moved() const { return moved_; }
  /// The validation of the values that were found, until they have been used.
  const std::optional<Validation>& found() const { return found_; }
  void forget() { found_.reset(); }
  void members(SavedState& state);

 private:
  struct Candidate {
    Vector x;
    Validation validation;
    void members(SavedState& state) { state(x, validation); }
  };
  IorLineSearch ior_;
  std::vector<Candidate> candidates_;
  std::optional<Validation> found_;
  bool moved_ = false;
};

}  // namespace selenite
