// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/solver/field_gauss_newton.h"

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
  /// Null where the world's image is not unknown, or is not stepped by `FieldGaussNewton`. `problem` must
  /// outlive it.
  static std::unique_ptr<LightStart> of(const FitProblem& problem, std::uint64_t seed);

  /// The next pass; false when it was the last. Throws what `evaluator` throws.
  bool step(PhotoEvaluator& evaluator);
  bool over() const { return done_ >= options_.passes; }
  double fraction() const { return static_cast<double>(done_) / options_.passes; }
  const FieldValues& fields() const { return solver_->values(); }
  void members(SavedState& state) { state(*solver_, done_); }

 private:
  LightStart(const FitProblem& problem, std::vector<Photo> photos, std::uint64_t seed);

  LightStartOptions options_;
  const FitProblem* problem_;
  std::vector<Photo> photos_;  ///< small
  std::vector<Eigen::VectorXf> weights_;
  std::unique_ptr<FieldGaussNewton> solver_;
  std::uint64_t seed_;
  int done_ = 0;
};

}  // namespace selenite
