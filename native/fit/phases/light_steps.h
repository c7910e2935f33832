// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "fit/evaluate/photo_evaluator.h"
#include "fit/solver/field_gauss_newton.h"

namespace selenite {

/// Steps of the world's image alone, while scalars and all other fields stand still. Light is linear, so
/// that few steps by least squares find it, whatever steps the rest.
class LightSteps {
 public:
  /// Null where the world's image is not unknown, or is too large for `FieldGaussNewton`.
  static std::unique_ptr<LightSteps> of(const Fields& fields, const std::vector<Photo>& photos);

  /// Goes on from these values of all fields, at which no residual has been seen.
  void begin(const FieldValues& all);
  /// Renders photo i with the derivatives by the image. `weight` of the residuals, 3 numbers a pixel; of
  /// the residuals before, the share `keep` stays.
  Film observe(PhotoEvaluator& evaluator, const Point& point, const Photo& photo, std::size_t i,
               const Evaluation& how, const Eigen::VectorXf& weight, double keep);
  /// The step that all photos together ask for, into the values of all fields. `done`: share of the
  /// iterations.
  void step(double done, FieldValues& all);
  void members(SavedState& state) { state(solver_); }

 private:
  LightSteps(Fields lights, std::size_t field, const std::vector<Photo>& photos);

  Fields lights_;      ///< the world's image alone
  std::size_t field_;  ///< which of all fields it is
  FieldGaussNewton solver_;
};

}  // namespace selenite
