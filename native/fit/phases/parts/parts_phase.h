// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "fit/phases/parts/part_disagreement.h"
#include "fit/phases/refinement.h"
#include "fit/state/phase.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "PartsOptions".
struct PartsOptions {
  std::size_t most = 4;    ///< parts
  std::size_t photos = 2;  ///< of a part, where there are enough for two parts
  int share = 4;           ///< of the samples of a refinement
  int passes = 3;          ///< of each part
};

/// Where the photos are not explained: disjoint parts of them are refitted from the answer, and its intervals
/// widened by what they disagree. Photo i belongs to part i modulo their number, as lists run round a body.
class PartsPhase final : public Phase {
 public:
  /// Null where there is nothing to find out: the photos are explained, or too few, or no value has an
  /// interval. `absent`: weights that the answer does without.
  static std::unique_ptr<PartsPhase> of(const FitRun& run, const std::vector<AbsentWeight>& absent);
  /// One whose state is about to be read.
  explicit PartsPhase(const FitRun& run);

  PhaseKind kind() const override { return PhaseKind::kParts; }
  bool step(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

 private:
  std::size_t count() const;
  void begin_part();

  PartsOptions options_;
  const FitProblem* problem_;
  Point at_;                          ///< the answer
  std::vector<AbsentWeight> absent_;  ///< these stay at 0
  std::vector<PartAnswer> done_;
  std::unique_ptr<Refinement> refinement_;  ///< of the present part
};

}  // namespace selenite
