// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/photo_evaluator.h"

#include <algorithm>

#include "fit/evaluate/field_loss.h"
#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

constexpr double kTooManyDropped = 1e-3;  ///< share of the samples

}  // namespace

void RenderCounts::add(const Film& film, const Photo& photo) {
  const std::int64_t pixels =
      photo.pixels ? std::ranges::count_if(*photo.pixels, [](auto one) { return one != 0; })
                   : static_cast<std::int64_t>(film.size());
  samples += pixels * film.spp;
  dropped += film.dropped;
  cpu_seconds += film.cpu_seconds;
  if (film.dropped > 0 && first_dropped.empty()) first_dropped = film.first_dropped;
}

bool RenderCounts::too_many_dropped() const {
  return static_cast<double>(dropped) > kTooManyDropped * static_cast<double>(samples);
}

std::string RenderCounts::dropped_text() const {
  return std::to_string(dropped) + " of " + std::to_string(samples) +
         " samples were not finite and left out; first: " + first_dropped +
         ". Check the scene for extreme values";
}

SceneModel scene_model(const FitProblem& problem) {
  return {problem.scalars(), problem.differences(),
          [&problem](const Point& point) { return problem.scene_at(point); }};
}

SceneModel scene_model(const FitProblem& problem, const UniformFields& uniform) {
  return {uniform.problem(), problem.differences() ? &uniform.reparametrization() : nullptr,
          [&uniform](const Point& point) { return uniform.scene_at(point.scalars); }};
}

RenderSettings PhotoEvaluator::render_settings(const Photo& photo, int spp,
                                               std::uint64_t seed) const {
  RenderSettings settings;
  settings.width = photo.width;
  settings.height = photo.height;
  settings.spp = spp;
  settings.seed = seed;
  settings.depth = settings_->depth;
  settings.threads = settings_->threads;
  settings.frame = photo.frame;
  settings.pixels = photo.pixels;
  return settings;
}

Film PhotoEvaluator::picture(const Scene& scene, const Photo& photo, const SlotLayout& layout,
                             int spp, std::uint64_t seed) {
  Film film = settings_->renderer(scene, scene.camera(photo.camera), layout,
                                  render_settings(photo, spp, seed), progress_);
  counts_->add(film, photo);
  return film;
}

Film PhotoEvaluator::evaluate(const Point& point, const Photo& photo, const Evaluation& how) {
  const Scene scene = scene_of(photo, point);
  if (!how.derivatives) return picture(scene, photo, SlotLayout(), how.spp, how.seed);
  Point there = point;
  return render_derivatives(
      model_.problem, model_.differences, scene, photo, point.scalars, how.purpose,
      *how.derivatives, [&](const Vector& at, const SlotLayout& layout, Paths paths) {
        there.scalars = at;
        const std::uint64_t seed = paths == Paths::kOfFilm ? how.seed : seed_of(how.seed, 1, 0);
        return picture(scene_of(photo, there), photo, layout, how.spp, seed);
      });
}

FieldGradient PhotoEvaluator::field_gradient(const Point& point, const Photo& photo,
                                             const Fields& fields, const Loss& loss,
                                             const Evaluation& how) {
  const Scene scene = scene_of(photo, point);
  FieldGradient found = loss_field_gradient(scene, scene.camera(photo.camera), fields, photo, loss,
                                            render_settings(photo, how.spp, how.seed), progress_);
  counts_->add(found.film, photo);
  return found;
}

FieldJacobian PhotoEvaluator::field_jacobian(const Point& point, const Photo& photo,
                                             const Fields& fields,
                                             const std::vector<float>& weights, int cell,
                                             const Evaluation& how) {
  const Scene scene = scene_of(photo, point);
  FieldJacobian found =
      render_field_jacobian(scene, scene.camera(photo.camera), fields.refs(),
                            render_settings(photo, how.spp, how.seed), weights, cell, progress_);
  counts_->add(found.film, photo);
  return found;
}

}  // namespace selenite
