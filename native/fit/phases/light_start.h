// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fit/phases/light_steps.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "LightStartOptions".
struct LightStartOptions {
  int size = 40;  ///< pixels of the longer side of the pictures
  int passes = 6, spp = 16;
  double kept = 0.5;  ///< share of the residuals that a pass keeps: the light has moved since
};

/// Where the world's image is unknown: the light that explains small photos of the scene as it is, before
/// a multi-start. Light is linear, so that few passes find it; under a uniform light in its place, shadows
/// and highlights would be explained by the materials.
class LightStart {
 public:
  /// Null where the world's image is not unknown, or is not stepped by `LightSteps`. `problem` must
  /// outlive it.
  static std::unique_ptr<LightStart> of(const FitProblem& problem, std::uint64_t seed);

  /// The next pass; false when it was the last. Throws what `evaluator` throws.
  bool step(PhotoEvaluator& evaluator);
  bool over() const { return done_ >= options_.passes; }
  double fraction() const { return static_cast<double>(done_) / options_.passes; }
  /// All fields, the world's image as it is found.
  const FieldValues& fields() const { return fields_; }
  void members(SavedState& state) { state(*steps_, fields_, done_); }

 private:
  LightStart(const FitProblem& problem, std::vector<Photo> photos,
             std::unique_ptr<LightSteps> steps, std::uint64_t seed);

  LightStartOptions options_;
  const FitProblem* problem_;
  std::vector<Photo> photos_;  ///< small
  std::vector<Eigen::VectorXf> weights_;
  std::unique_ptr<LightSteps> steps_;
  FieldValues fields_;
  std::uint64_t seed_;
  int done_ = 0;
};

}  // namespace selenite
