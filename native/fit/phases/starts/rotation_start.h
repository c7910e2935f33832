// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "RotationStartOptions".
struct RotationStartOptions {
  int size = 64;     ///< pixels of the longer side of the pictures
  int spp = 32;      ///< samples per pixel
  int angles = 32;   ///< evenly around, the start among them
  int halvings = 3;  ///< of their distance, around the best of them
};

/// Where the rotation of the world's image is unknown: the angle at which small pictures of the scene as it
/// is look most like the photos after one factor, before a multi-start. Steps find a minimum within few
/// degrees only, and there are many.
class RotationStart {
 public:
  /// Null where no rotation is unknown. `problem` must outlive it.
  static std::unique_ptr<RotationStart> of(const Problem& problem, std::uint64_t seed,
                                           const RotationStartOptions& options = {});

  /// The next angle; false when it was the last. Throws what `evaluate` throws.
  bool step(Evaluator& evaluator);
  bool over() const { return halving_ > options_.halvings; }
  double fraction() const;
  /// Once over: the start with the best angle, and with the factor on the world's strength if that is
  /// unknown as well.
  Vector values() const;
  void members(SavedState& state) { state(angles_, misfits_, factors_, halving_); }

 private:
  RotationStart(const Problem& problem, int component, std::uint64_t seed,
                const RotationStartOptions& options);
  /// The start at an angle, within its bounds by full turns where these permit it.
  Vector at(double angle) const;
  bool is_permitted(double angle) const;
  std::size_t best() const;
  void add_angles();

  RotationStartOptions options_;
  const Problem* problem_;
  int component_;
  std::uint64_t seed_;
  std::vector<Photo> photos_;  ///< small
  std::vector<Eigen::VectorXf> weights_;
  std::vector<double> angles_;             ///< to be tried, radians
  std::vector<double> misfits_, factors_;  ///< of those that have been
  int halving_ = 0;                        ///< of the angles that are tried now
};

}  // namespace selenite
