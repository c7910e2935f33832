// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "fit/objective/photo_weights.h"
#include "fit/phases/parts/part_disagreement.h"
#include "fit/phases/refinement.h"
#include "fit/state/phase.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "PartsOptions".
struct PartsOptions {
  std::size_t most = 4;    ///< parts
  std::size_t photos = 2;  ///< of a part, where there are enough for two parts
  int share = 4;           ///< of the samples of a refinement
  int rounds = 3;          ///< of weights: by brightness, then by what the part shows of its errors
  int passes = 2;          ///< of a round
};

/// Where the photos are not explained: disjoint parts of them are refitted from the answer, and its intervals
/// widened by what they disagree. Photo i belongs to part i modulo their number, as lists run round a body.
/// A part has weights of its own: by those of all photos, what does not suit the answer counts little.
class PartsPhase final : public Phase {
 public:
  /// Null where there is nothing to find out: the photos are explained, or too few, or no value has an
  /// interval. `absent`: weights that the answer does without.
  static std::unique_ptr<PartsPhase> of(FitRun& run, const std::vector<AbsentWeight>& absent);
  /// One whose state is about to be read.
  explicit PartsPhase(FitRun& run);

  PhaseKind kind() const override { return PhaseKind::kParts; }
  bool step(FitRun& run) override;
  double fraction() const override;
  void members(SavedState& state) override;

 private:
  /// Some of the photos as a problem of their own.
  struct Part {
    Part(FitRun& run, std::vector<Photo> some);
    Part(const Part&) = delete;  // the problem refers to the photos
    Part& operator=(const Part&) = delete;

    std::vector<Photo> photos;
    Problem problem;
    PhotoEvaluator evaluator;
    std::unique_ptr<Refinement> refinement;
    int round = 0;
  };

  std::size_t count() const;
  int spp() const;
  std::uint64_t seed() const;
  void begin_part();
  void begin_round(const Vector& x);
  /// Weights of the part by its residuals at x.
  void learn(const Vector& x);

  PartsOptions options_;
  FitRun* run_;
  Point at_;                          ///< the answer
  std::vector<AbsentWeight> absent_;  ///< these stay at 0
  std::vector<PartAnswer> done_;
  std::unique_ptr<Part> part_;  ///< the present one
};

}  // namespace selenite
