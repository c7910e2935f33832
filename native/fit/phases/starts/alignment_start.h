// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "AlignmentStartOptions".
struct AlignmentStartOptions {
  int passes = 4, spp = 16;
  double noticed = 0.5;  ///< pixels of the search's pictures: it is made again
};

/// Where cameras are off by pixels: how the photos lie beside pictures of what a multi-start has found.
/// From there the descent goes on, or the search begins anew. The small pictures of the search differ from
/// such photos at all edges, and a wrong basin may make up for it. The scene as it is would not tell the
/// shifts: its shading can be far from the photos'.
class AlignmentStart {
 public:
  /// Null where no photo is aligned. `photos` must outlive it.
  static std::unique_ptr<AlignmentStart> of(const std::vector<Photo>& photos, std::uint64_t seed);

  /// The next pass, at the values x; false when it was the last. `evaluator`, whose problem has these
  /// photos, keeps what is found. Throws what it throws.
  bool step(PhotoEvaluator& evaluator, const Vector& x);
  bool over() const { return done_ >= options_.passes; }
  double fraction() const { return static_cast<double>(done_) / options_.passes; }
  /// Once over: whether pictures of so many pixels on the longer side show it.
  bool moved(const PhotoEvaluator& evaluator, int size) const;
  /// Whether they would show a photo's largest shift.
  bool may_move(int size) const;
  void members(SavedState& state) { state(done_); }

 private:
  AlignmentStart(const std::vector<Photo>& photos, std::uint64_t seed)
      : photos_(&photos), seed_(seed) {}

  AlignmentStartOptions options_;
  const std::vector<Photo>* photos_;
  std::uint64_t seed_;
  int done_ = 0;
};

}  // namespace selenite
