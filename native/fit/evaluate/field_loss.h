// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>

#include "fit/problem/fields.h"
#include "fit/problem/loss.h"
#include "fit/problem/pixel_weights.h"
#include "render/driver/field_gradient.h"

namespace selenite {

/// A loss of what a render gives. `weights` as of `Loss::evaluate_by`.
struct FilmLoss {
  FilmLoss(const Loss& loss, Eigen::VectorXf weights)
      : evaluate(loss.evaluate_by), weights(std::move(weights)), per_pixel(loss.per_pixel) {}

  /// By the weights that hold before anything has been learned.
  FilmLoss(const Loss& loss, const Photo& photo)
      : FilmLoss(loss, loss.weighted ? relative_weights(photo, 1) : Eigen::VectorXf()) {}

  std::function<LossResult(const Film& film, const Photo& photo, const Eigen::VectorXf& weights)>
      evaluate;
  Eigen::VectorXf weights;
  bool per_pixel;  ///< see Loss
};

/// Picture, and the loss's derivative by every value of the fields, from the same samples: in one pass
/// where the loss is a sum over pixels, else in two.
FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Photo& photo, const FilmLoss& loss,
                                  const RenderSettings& settings, Progress* progress);

}  // namespace selenite
