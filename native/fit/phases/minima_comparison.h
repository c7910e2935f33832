// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/evaluate/paired_test.h"
#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/inference/confidence_intervals.h"

namespace selenite {

/// Compares the answer of a fit with values that its search refined and left for others, and with
/// itself after an exchange of what acts alike: where one of them explains the photos as well, another
/// basin may hold the truth, of which intervals around the answer know nothing. Where one explains
/// them better, it does.
///
/// Equal seeds, first with a sixteenth of the samples, then with a quarter and with all for those
/// that still stand. A alternative loses by `TiledLoss`, coarse or in detail, or by `PairedMidpointTest`. Refined in
/// small pictures only, it is worse than the bottom of its basin: photos that tell basins apart do so
/// here, too.
class MinimaComparison {
 public:
  /// `problem` must outlive it. weights: of the residuals of each photo, 3 numbers a pixel. spp:
  /// samples of a pixel at most.
  MinimaComparison(const Problem& problem, std::vector<Eigen::VectorXf> weights, Point answer,
                   std::vector<Vector> alternatives, std::uint64_t seed, int spp);
  /// The next picture; false when it was the last. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  double fraction() const;
  /// After the last step: one that stands and lies far from the answer, and by how many standard
  /// deviations the photos are nearer to it than to the answer.
  struct Survivor {
    Vector x;
    double z_score;
    /// Nearer for certain.
    bool is_better() const;
  };
  /// Likewise: those that lie far from the answer, the nearest to the photos first.
  std::vector<Survivor> survivors() const;
  /// Likewise: those of them that matter, because they won or because they contest what `report` tells.
  std::vector<Survivor> pending(const TrustReport& report) const;

  void members(SavedState& state);

 private:
  struct Candidate {
    Vector x;
    FilmPair seen;                      ///< of the current photo
    TiledLoss tiled_loss;               ///< of this round
    PairedMidpointTest against_answer;  ///< likewise: how much nearer to the photos the answer is
    void members(SavedState& state) { state(x, seen, tiled_loss, against_answer); }
  };

  int spp() const;
  void end_photo();
  void end_round();

  const Problem* problem_;
  Reparametrization reparametrization_;
  FieldValues fields_;
  std::vector<Eigen::VectorXf> weights_;
  std::vector<Candidate> candidates_;  ///< the answer, then those that stand
  std::uint64_t seed_;
  int most_spp_;
  int round_ = 0;
  std::size_t photo_ = 0, candidate_ = 0;  ///< of the next picture
  std::size_t part_ = 0;                   ///< likewise
};

/// Notes in `report`, which is about `answer`, a alternative that explains the photos as well if it lies far
/// outside what is reported, and takes back that these values are determined. refined: at the bottom of
/// its basin; else widths of an interval may lie between what are the same values.
void mark_ambiguous(TrustReport& report, const Reparametrization& reparametrization,
                    const Vector& answer, const Vector& alternative, bool refined);

}  // namespace selenite
