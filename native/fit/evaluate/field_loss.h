// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

#include "fit/problem/fields.h"
#include "fit/problem/loss.h"
#include "render/driver/field_gradient.h"

namespace selenite {

/// A loss of what a render gives.
struct FilmLoss {
  FilmLoss(const Loss& loss) : evaluate(loss.evaluate), per_pixel(loss.per_pixel) {}

  std::function<LossResult(const Film& film, const Photo& photo)> evaluate;
  bool per_pixel;  ///< see Loss
};

/// Picture, and the loss's derivative by every value of the fields, from the same samples: in one pass
/// where the loss is a sum over pixels, else in two.
FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Photo& photo, const FilmLoss& loss,
                                  const RenderSettings& settings, Progress* progress);

}  // namespace selenite
