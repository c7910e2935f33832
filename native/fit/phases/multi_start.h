// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "fit/evaluate/finite_differences.h"
#include "fit/evaluate/paired_test.h"
#include "fit/evaluate/photo_evaluator.h"
#include "fit/evaluate/tiled_loss.h"
#include "fit/problem/significance.h"
#include "fit/solver/gauss_newton.h"
#include "fit/state/fit_result.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "MultiStartOptions".
struct MultiStartOptions {
  int photos = 12;  ///< looked at, but for those that alone show one of the unknowns
  int size = 40;    ///< pixels of the longer side of the pictures
  int points = 64;  ///< beside the start
  int first_spp = 8, step_spp = 8, final_spp = 48;
  /// After all points: so many go on, by so many steps each; beside them the start as it is and, where
  /// it is not among them, stepped like them.
  struct Round {
    int count, steps;
  };
  std::array<Round, 3> rounds{{{8, 4}, {4, 5}, {3, 6}}};
  double margin = 0.1;    ///< of the range, on both sides: the ends are flat
  double greyness = 0.3;  ///< of the range: how far channels stray from their grey
  /// An extinction has the scale of the scene, light that of a photo: points lie within this factor of
  /// the start.
  double extinction_factor = 10;
  double least_ior = 1.2, largest_ior = 2;  ///< of most dielectrics
  double sigmas = kLikelySigmas;            ///< by which one must lose to another
  double same_basin = kNarrowShare;         ///< of each range
  /// Standard deviations of a loss that are added for ranking: where light comes by rare bright paths
  /// (sharp glass) a loss is often below its mean by luck.
  double rank_sigmas = 1;
};

/// Indices of the photos that a multi-start looks at, in their order: one of each of equal stretches of
/// the list, at a place by chance, as lists repeat cameras and lamps. For an unknown that shows in none
/// of them, the first one that shows it.
std::vector<std::size_t> searched_photos(const Problem& problem, const Scene& scene,
                                         const MultiStartOptions& options = {});

/// Finds the basin before the first step: evaluates points spread over the bounds in small pictures
/// with few samples, and steps the best of them by Gauss-Newton, fewer and fewer of them.
///
/// A step follows the slope from where it stands; from a dark opaque start that may lead into a
/// basin where another parameter does the brightening. Few samples know little of single pixels where
/// light comes by rare bright paths: pictures are compared coarsely, and in detail as far as the
/// details of candidates differ by more than noise. The user's values compete, stepped like the others
/// and as they are: those lose only to what is better by more than noise. The channels of a colour share
/// a grey, which steps mend at once. Source: docs/method/optimisation.md, "Multi-start".
class MultiStart {
 public:
  /// photos: indices of those that are looked at. `problem` must outlive it.
  MultiStart(const Problem& problem, const std::vector<std::size_t>& photos, std::uint64_t seed,
             const MultiStartOptions& options = {});
  MultiStart(const MultiStart&) = delete;  // the small problem refers to members
  MultiStart& operator=(const MultiStart&) = delete;

  /// Begins, or begins anew, with these values for the user's.
  void begin_at(const Vector& start);
  /// The next portion of the work; false when nothing is left. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  /// Ends it with the best of what has been evaluated; the user's values lose only to what is better by
  /// more than noise. False where nothing is known yet: then they stay.
  bool cut_short();
  /// By the samples that are taken.
  double fraction() const;
  /// Once `step` has returned false: the values to go on from.
  const Vector& values() const { return chosen_; }
  const MultiStartResult& result() const { return result_; }
  /// Likewise: other values that were stepped to the end.
  std::vector<Vector> others() const;

  void members(SavedState& state);

 private:
  /// The round that chooses.
  int last_round() const { return static_cast<int>(options_.rounds.size()) + 1; }
  struct Candidate {
    Vector x;
    bool from_start = false, untouched = false;
    double loss = 0, rank = 0;
    TiledLoss tiled_loss;            ///< of the newest evaluation
    std::vector<FilmPair> pictures;  ///< of the last round's, photo by photo
    Eigen::ArrayXd tiles;            ///< of `loss`
    std::shared_ptr<GaussNewton> steps;
  };

  double point_in_range(int component, double at) const;
  std::vector<Vector> spread_points() const;
  std::uint64_t seed_for(int purpose, int index, int photo) const;
  void evaluate(Candidate& candidate, int spp, int purpose, Evaluator& evaluator);
  /// How many steps a candidate makes in the running round.
  int steps_of(const Candidate& candidate) const;
  /// The n-th of them.
  void descend(Candidate& candidate, int n, Evaluator& evaluator) const;
  /// Samples that a candidate takes in a round, per pixel.
  double work(int round, bool steps) const;
  void rank();
  bool same_basin(const Vector& x, const Vector& y) const;
  bool equivalent(const Candidate& one, const Candidate& other) const;
  void keep_best(std::size_t count);
  double distance_to_bounds(const Vector& x) const;
  void choose();
  void note_best();

  MultiStartOptions options_;
  std::uint64_t seed_;
  std::vector<Photo> photos_;  ///< small
  std::vector<Eigen::VectorXf> weights_;
  Problem problem_;
  Reparametrization reparametrization_;
  std::vector<Candidate> candidates_;
  std::size_t next_ = 0;  ///< candidate of the running round
  Ahead ahead_;           ///< in the running round
  int round_ = 0;
  int stepped_ = 0;  ///< steps that it has made in this round
  Vector chosen_;
  MultiStartResult result_;
};

}  // namespace selenite
