// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fit/phases/minima_comparison.h"
#include "fit/phases/refinement.h"
#include "fit/state/phase.h"

namespace selenite {

/// Values far from the answer that may explain the photos as well: those that a multi-start left for
/// others, and the answer with unknowns that act alike exchanged. Each refined answer is compared with
/// them; those that matter are refined in their turn and may take its place. So are those that need fewer
/// weights (`without_weights`), which win where the photos do not tell them from the answer.
class AlternativeMinima {
 public:
  void add_candidates(std::vector<Vector> candidates) { candidates_ = std::move(candidates); }
  /// Alternatives that have been refined, or are being.
  int refined() const { return count_; }
  /// Takes the end of a refinement; the first one is the answer.
  void take(FitRun& run, Refinement& refinement);
  /// The comparison that follows; null where there is nothing to compare.
  std::unique_ptr<MinimaComparison> comparison(const FitRun& run) const;
  /// Takes the end of a comparison: moves to what explains the photos best, and reports the others.
  void take(FitRun& run, const MinimaComparison& comparison);
  /// The alternative to be refined next, if there is one.
  std::optional<Alternative> next();
  /// Weights that the answer does without.
  const std::vector<AbsentWeight>& absent() const {
    return (answer_ ? *answer_ : newest_).at.absent;
  }
  void members(SavedState& state);

 private:
  struct Refined {
    Alternative at;
    TrustReport report;
    void members(SavedState& state) { state(at, report); }
  };
  void choose(const MinimaComparison& comparison);
  void report(const FitRun& run, TrustReport& report) const;

  std::vector<Vector> candidates_;
  Refined newest_;                        ///< by the newest refinement
  std::vector<Eigen::VectorXf> weights_;  ///< of the residuals there
  std::optional<Refined> answer_;         ///< once it has been compared
  std::vector<Alternative> simpler_;      ///< than the answer, not refined yet
  std::vector<Vector> pending_;           ///< not excluded and not refined yet
  std::vector<Refined> equivalent_;       ///< refined, and as good as the answer
  int count_ = 0;                         ///< of those that have been refined
  int others_ = 0;                        ///< of them, those that are not simpler
};

}  // namespace selenite
