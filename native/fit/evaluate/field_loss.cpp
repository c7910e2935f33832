// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/field_loss.h"

namespace selenite {
namespace {

/// The loss of one pixel, where losses of pixels add up.
PixelSlope slope_of_pixel(const FilmLoss& loss, const Film& film, const Photo& photo,
                          std::size_t pixel) {
  Film one;
  one.width = one.height = 1;
  one.spp = film.spp;
  one.mean = {film.mean[pixel]};
  one.half_a = {film.half_a[pixel]};
  one.variance = {film.variance[pixel]};
  Photo part;
  part.id = photo.id;
  part.camera = photo.camera;
  part.width = part.height = 1;
  part.reference = {photo.reference[pixel]};
  part.weight = {photo.weight[pixel]};
  part.total_weight = photo.total_weight;
  Eigen::VectorXf weights;
  if (loss.weights.size() > 0)
    weights = loss.weights.segment<3>(static_cast<Eigen::Index>(3 * pixel));
  const LossResult result = loss.evaluate(one, part, weights);
  return {result.slope[0], result.curvature.empty() ? Colorf() : result.curvature[0]};
}

}  // namespace

FieldGradient loss_field_gradient(const Scene& scene, const Camera& camera, const Fields& fields,
                                  const Photo& photo, const FilmLoss& loss,
                                  const RenderSettings& settings, Progress* progress) {
  const auto render = [&](const PixelLoss& pixel) {
    return render_field_gradient(scene, camera, fields.carried(), settings, pixel, progress);
  };
  if (loss.per_pixel)
    return render([&](std::size_t pixel, const Film& film) {
      return slope_of_pixel(loss, film, photo, pixel);
    });
  const FieldGradient first = render({});
  const LossResult result = loss.evaluate(first.film, photo, loss.weights);
  FieldGradient second = render([&](std::size_t pixel, const Film&) {
    return PixelSlope{result.slope[pixel],
                      result.curvature.empty() ? Colorf() : result.curvature[pixel]};
  });
  second.film.seconds += first.film.seconds;
  second.film.cpu_seconds += first.film.cpu_seconds;
  return second;
}

}  // namespace selenite
