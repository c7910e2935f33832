// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "fit/photo/photo.h"
#include "fit/problem/fields.h"
#include "fit/problem/loss.h"
#include "fit/problem/point.h"
#include "fit/problem/problem.h"
#include "fit/problem/reparametrization.h"
#include "fit/problem/settings.h"
#include "fit/problem/uniform_fields.h"
#include "fit/problem/unknowns.h"

namespace selenite {

/// All that is constant while a fit runs: scene, photos, unknowns and settings, validated once.
class FitProblem {
 public:
  /// Reports all problems at once, one line each: InvalidArgument, or UnknownName when names that do
  /// not exist are the only problem.
  FitProblem(Scene scene, std::vector<Photo> photos, const std::vector<UnknownParameter>& unknowns,
             FitSettings settings);
  FitProblem(const FitProblem&) = delete;  // `scalars` refers to members
  FitProblem& operator=(const FitProblem&) = delete;

  const std::vector<Photo>& photos() const { return photos_; }
  const Unknowns& unknowns() const { return unknowns_; }
  const Fields& fields() const { return fields_; }
  const FitSettings& settings() const { return settings_; }
  const Loss& loss() const { return loss_; }
  /// What a solver of the scalars needs.
  const Problem& scalars() const { return problem_; }
  /// Null where the settings ask for derivatives in place of finite differences.
  const Reparametrization* differences() const { return differences_.get(); }
  /// The problem with one colour for each field; null where there is none (see `UniformFields`).
  std::unique_ptr<UniformFields> uniform() const;

  Point start() const { return {unknowns_.start(), fields_.start()}; }
  /// The scene at a point, and with the values of the scalars alone.
  Scene scene_at(const Point& point) const;
  Scene scene_at(const Vector& scalars) const { return unknowns_.scene_with(scene_, scalars); }
  /// Sets the number of iterations in which a solver steps the scalars.
  void set_scalar_iterations(int iterations) { problem_.iterations = iterations; }
  void set_goes_on() { problem_.goes_on = true; }
  void set_weights(std::shared_ptr<PhotoWeights> weights) { problem_.weights = std::move(weights); }
  /// Names and numbers that a saved state belongs to: with others it would be misread.
  std::string fingerprint() const;

 private:
  Scene scene_;
  std::vector<Photo> photos_;
  std::vector<UnknownParameter> wanted_;
  Unknowns unknowns_;
  Fields fields_;
  FitSettings settings_;
  const Loss& loss_;
  SlotLayout layout_;
  Problem problem_;
  std::unique_ptr<Reparametrization> differences_;
};

}  // namespace selenite
