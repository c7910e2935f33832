// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fit/evaluate/paired_test.h"
#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/inference/confidence_intervals.h"
#include "fit/problem/significance.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "AlternativeMinimaOptions".
struct AlternativeMinimaOptions {
  std::array<int, 3> shares{kFirstShare, kSecondShare, 1};  ///< of the samples, a round each
  int least_of_round = 16;                                  ///< samples, where there are as many
  double sigmas =
      kCertainSigmas;  ///< standard deviations by which an alternative must be worse to lose
  /// Widths of its interval, and share of its range, by which a value of an alternative is off at least:
  /// what is nearer is the same basin at another resolution.
  double widths = 2, share_of_range = kNarrowShare;
  int most_refined = 2;  ///< alternatives, without the answer and simpler ones
};
inline constexpr AlternativeMinimaOptions kAlternativeMinima;

/// Compares the answer of a fit with alternatives, which may lie in the basin of the truth.
///
/// Seeds are equal. A sixteenth of the samples is taken first, then a quarter, then all, for those that
/// have not lost. An alternative loses by `TiledLoss`, blurred or pixel by pixel, or by
/// `PairedMidpointTest`. It has been refined in small pictures only, and so is worse than the bottom of
/// its basin: photos that separate basins do so here, too.
class MinimaComparison {
 public:
  /// `problem` must outlive it. weights: of the residuals of each photo, 3 numbers a pixel. spp:
  /// samples of a pixel at most.
  MinimaComparison(const Problem& problem, std::vector<Eigen::VectorXf> weights, Point answer,
                   std::vector<Vector> alternatives, std::uint64_t seed, int spp);
  /// The next picture; false when it was the last. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  double fraction() const;
  /// An alternative that has not lost. z_score: standard deviations by which the photos are nearer to it
  /// than to the answer. far: it lies in another basin. Known after the last step.
  struct Survivor {
    Vector x;
    double z_score;
    bool far;
    /// Nearer beyond doubt.
    bool is_better() const;
  };
  /// The nearest to the photos first.
  std::vector<Survivor> survivors() const;
  /// Those of them in other basins that are better, or that make values ambiguous which `report` has as
  /// determined.
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
  std::vector<Candidate> candidates_;  ///< the answer, then those that have not lost
  std::uint64_t seed_;
  int most_spp_;
  int round_ = 0;
  std::size_t photo_ = 0, candidate_ = 0;  ///< of the next picture
  std::size_t part_ = 0;                   ///< likewise
  Ahead ahead_;                            ///< in this round
};

/// Adds to `report`, which is about `answer`, an alternative that explains the photos as well if it lies
/// far outside the intervals; the values in question are no longer determined. refined: it is at the
/// bottom of its basin. Otherwise some widths of an interval may lie between equal values.
void mark_ambiguous(TrustReport& report, const Reparametrization& reparametrization,
                    const Vector& answer, const Vector& alternative, bool refined);

}  // namespace selenite
