// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/photo_evaluator.h"

#include <algorithm>
#include <utility>

#include "fit/evaluate/field_loss.h"
#include "fit/evaluate/rendered_pixels.h"
#include "fit/evaluate/seeds.h"
#include "fit/objective/closed_form_gain.h"
#include "fit/objective/photo_weights.h"
#include "model/field_index.h"
#include "render/shape/fixed_normals.h"

namespace selenite {
namespace {

constexpr int kMostExpected = 4;  ///< pictures, in units of `ahead`
constexpr int kGain = field_index<PhotoParameters>(&PhotoParameters::gain);

/// The loss at a photo's gain, differentiated by what was rendered.
FilmLoss loss_of_rendered(FilmLoss loss, const Colorf& gain) {
  if (gain == Colorf(1)) return loss;
  loss.evaluate = [evaluate = std::move(loss.evaluate), gain](
                      const Film& rendered, const Photo& photo, const Eigen::VectorXf& weights) {
    Film film = rendered;
    apply_gain(gain, film);
    LossResult result = evaluate(film, photo, weights);
    scale(result.slope, gain);
    scale(result.curvature, gain * gain);
    return result;
  };
  return loss;
}

/// Pictures that no phase reads need neither travel nor keep their memory, as `clear` would let them.
void leave_out_unread(const Photo& photo, const Evaluation& how, Film& film) {
  if (how.all_pictures) return;
  film.aim_excess = Picture();
  if (!how.halves) film.half_a = Picture();
  const bool gradient = how.purpose == Purpose::kGradient;
  for (SlotFilm& slot : film.slots) {
    slot.aim_excess = Picture();
    slot.variance = Picture();
    if (gradient) slot.half_a = Picture();
    if (!gradient && photo.gain_freedom == GainFreedom::kNone) slot.covariance = Picture();
  }
}

/// Columns of a field belong to channels in turns.
void scale_fields(const Colorf& gain, const Photo& photo, const Fields& fields,
                  FieldJacobian& found) {
  if (gain == Colorf(1)) return;
  for (std::size_t f = 0; f < found.fields.size(); ++f) {
    if (found.fields[f].cols() > 0 && fields.channels(f) != 3)
      throw Refused("",
                    "Photo '" + photo.id + "' has a gain, and " + fields.names()[f] +
                        " one number for all channels",
                    "choose optimiser = 'adam'");
    for (Eigen::Index k = 0; k < found.fields[f].cols(); ++k)
      found.fields[f].col(k) *= gain[static_cast<int>(k % 3)];
    for (std::vector<PlaceSlope>& row : found.places[f])
      for (PlaceSlope& one : row) one.slope *= gain;
  }
}

}  // namespace

SceneModel scene_model(const FitProblem& problem) {
  return {problem.scalars(), problem.differences(),
          [&problem](const Point& point) { return problem.scene_at(point); }};
}

SceneModel scene_model(const FitProblem& problem, const UniformFields& uniform) {
  return {uniform.problem(), problem.differences() ? &uniform.reparametrization() : nullptr,
          [&uniform](const Point& point) { return uniform.scene_at(point.scalars); }, false};
}

Scene PhotoEvaluator::scene_of(const Photo& photo, const Point& point) {
  return lit_for(photo, model_.scene_at(point));
}

Scene PhotoEvaluator::lit_for(const Photo& photo, const Scene& of_point) {
  Scene scene = photo.lights.applied_to(of_point);
  auto& lamps = scene.appearance.lights;
  const auto known = aims_.find(photo.id);
  if (known == aims_.end()) {
    const Camera camera = camera_of(scene, photo);  // before the scene is moved away
    scene = decide_aims(std::move(scene), camera, model_.problem.layout, settings_of(photo, 1, 0),
                        &aim_verdicts_, progress_);
    std::vector<char>& aims = aims_[photo.id];
    for (const Light& lamp : lamps) aims.push_back(lamp.aimed.value_or(false));
    return scene;
  }
  for (std::size_t i = 0; i < lamps.size(); ++i) lamps[i].aimed = known->second[i] != 0;
  return scene;
}

/// The pixels that count, and those around them.
RenderSettings PhotoEvaluator::settings_of(const Photo& photo, int spp, std::uint64_t seed) const {
  RenderSettings settings =
      render_settings(photo, {spp, seed, settings_->depth, settings_->threads});
  settings.pixels = rendered_pixels(photo);
  return settings;
}

Colorf PhotoEvaluator::gain_of(const Photo& photo, const Point& point) const {
  return Colorf(model_.problem.unknowns.photo_values(photo, point.scalars).gain);
}

Colorf PhotoEvaluator::found_gain(const Photo& photo) const {
  const auto found = gains_.find(photo.id);
  return found == gains_.end() ? Colorf(1) : found->second;
}

Alignment PhotoEvaluator::alignment(const Photo& photo) const {
  const auto found = alignments_.find(photo.id);
  if (found == alignments_.end()) return photo.alignment;
  const auto& [estimate, width] = found->second;
  return estimate.at.scaled(static_cast<double>(photo.width) / width);
}

Camera PhotoEvaluator::camera_of(const Scene& scene, const Photo& photo) const {
  return alignment(photo).apply(scene.camera(photo.camera), photo.width, photo.height, photo.frame);
}

/// Some pixels alone do not tell the gain of a photo.
void PhotoEvaluator::find_gain(const Photo& photo, const Film& film) {
  if (photo.gain_freedom == GainFreedom::kNone || photo.pixels) return;
  gains_[photo.id] = closed_form_gain(film, photo, gain_weights(model_.problem, photo),
                                      gain_prior(model_.problem, photo));
}

/// For the next render. Photos at another size than the problem's are too small to tell.
void PhotoEvaluator::find_alignment(const Photo& photo, const Film& film) {
  const auto is_photo = [&](const Photo& one) { return &one == &photo; };
  if (!photo.align || std::ranges::none_of(model_.problem.photos, is_photo)) return;
  const Eigen::VectorXf weights = gain_weights(model_.problem, photo);
  const AlignmentEquations equations(photo, weights);
  const FoundAlignment fresh{equations.prior(), photo.width};
  const auto found = alignments_.try_emplace(photo.id, fresh).first;
  found->second.estimate = equations.improved(found->second.estimate, film);
}

Film PhotoEvaluator::picture(Scene scene, const Photo& photo, const SlotLayout& layout, int spp,
                             std::uint64_t seed, bool direct) {
  RenderSettings settings = settings_of(photo, spp, seed);
  const Camera camera = camera_of(scene, photo);
  if (direct) {
    settings.depth = 1;
    for (Material& one : scene.appearance.materials) one.flavour.draws_reflections = true;
  }
  Film film = settings_->renderer(scene, camera, layout, settings, progress_);
  counts_->add(film, photo);
  return film;
}

Film PhotoEvaluator::rendered(const Point& point, const Photo& photo, const Evaluation& how) {
  Scene scene = scene_of(photo, point);
  if (!how.derivatives) {
    Film film = picture(std::move(scene), photo, SlotLayout(), how.spp, how.seed);
    leave_out_unread(photo, how, film);
    return film;
  }
  Point there = point;
  Film film = render_derivatives(
      model_.problem, model_.differences, scene, photo, point.scalars, how.purpose,
      *how.derivatives, [&](const Vector& at, const SlotLayout& layout, Paths paths) {
        there.scalars = at;
        const std::uint64_t seed = paths == Paths::kOther ? seed_of(how.seed, 1, 0) : how.seed;
        return picture(scene_of(photo, there), photo, layout, how.spp, seed,
                       paths == Paths::kDirect);
      });
  leave_out_unread(photo, how, film);
  return film;
}

PhotoQuestion PhotoEvaluator::question(const Point& point, const Photo& photo,
                                       const Evaluation& how) {
  if (!aims_.contains(photo.id)) scene_of(photo, point);
  return {point,
          photo.id,
          photo.width,
          photo.height,
          photo.frame,
          alignment(photo),
          rendered_pixels(photo),
          aims_[photo.id],
          how};
}

double PhotoEvaluator::work_of(const Photo& photo, const Evaluation& how) const {
  const int carried = how.derivatives ? model_.problem.unknowns.size() : 0;
  return rendered_count(photo) * how.spp * (1 + carried);
}

void PhotoEvaluator::expect(const Point& point, const Photo& photo, const Evaluation& how) {
  if (!workers()) return;
  expected_.workers = settings_->workers;
  std::string asked = question(point, photo, how).bytes();
  const std::int64_t number = workers()->ask(asked, work_of(photo, how));
  expected_.questions.emplace_back(std::move(asked), number);
  // A point that has changed since has left some that nobody wants.
  while (std::ssize(expected_.questions) > kMostExpected * ahead()) expected_.forget_oldest();
}

int PhotoEvaluator::ahead() const {
  return workers() ? std::max(1, 2 * workers()->busy_with()) : 0;
}

Film PhotoEvaluator::fetched(const Point& point, const Photo& photo, const Evaluation& how) {
  PhotoQuestion wanted = question(point, photo, how);
  const std::string asked = wanted.bytes();
  auto& questions = expected_.questions;
  const auto known =
      std::ranges::find(questions, asked, &std::pair<std::string, std::int64_t>::first);
  std::int64_t number = 0;
  if (known == questions.end()) {
    number = workers()->ask(asked, work_of(photo, how));
  } else {
    number = known->second;
    questions.erase(known);
  }
  PhotoAnswer answer = PhotoAnswer::of(workers()->answer(number, progress_), wanted.pixels.get());
  counts_->add(answer.counts);
  return std::move(answer.film);
}

Film PhotoEvaluator::answer(const PhotoQuestion& question) {
  const auto& photos = model_.problem.photos;
  const auto known = std::ranges::find(photos, question.photo, &Photo::id);
  if (known == photos.end())
    throw Refused("Photo '" + question.photo + "'", "the worker does not know it", "");
  Photo photo = *known;
  photo.width = question.width;
  photo.height = question.height;
  photo.frame = question.frame;
  photo.alignment = question.alignment;
  photo.pixels = question.pixels;
  aims_[photo.id] = question.aims;
  return rendered(question.point, photo, question.how);
}

PhotoEvaluator::Expected::~Expected() {
  while (!questions.empty()) forget_oldest();
}

void PhotoEvaluator::Expected::forget_oldest() {
  workers->forget(questions.front().second);
  questions.pop_front();
}

Film PhotoEvaluator::evaluate(const Point& point, const Photo& photo, const Evaluation& how) {
  Film film = workers() ? fetched(point, photo, how) : rendered(point, photo, how);
  std::optional<std::size_t> slot;
  if (const auto k = model_.problem.unknowns.component_of(PhotoParameterRef{photo.id, kGain});
      k && how.derivatives)
    slot = static_cast<std::size_t>(model_.problem.layout.rows[static_cast<std::size_t>(*k)].slot);
  apply_gain(gain_of(photo, point), film, slot);
  find_gain(photo, film);
  apply_gain(found_gain(photo), film);
  find_alignment(photo, film);
  return film;
}

FieldGradient PhotoEvaluator::field_gradient(const Point& point, const Photo& photo,
                                             const Fields& fields, FilmLoss loss,
                                             const Evaluation& how) {
  const Scene scene = scene_of(photo, point);
  // That of the last render of the photo: this one is differentiated while it is made.
  const Colorf gain = gain_of(photo, point) * found_gain(photo);
  FieldGradient found = loss_field_gradient(scene, camera_of(scene, photo), fields, photo,
                                            loss_of_rendered(std::move(loss), gain),
                                            settings_of(photo, how.spp, how.seed), progress_);
  counts_->add(found.film, photo);
  apply_gain(gain_of(photo, point), found.film);
  const Colorf before = found_gain(photo);
  find_gain(photo, found.film);  // for the next one
  apply_gain(before, found.film);
  find_alignment(photo, found.film);
  return found;
}

ShapeGradient PhotoEvaluator::shape_gradient(const Scene& scene, const MovableVertices& vertices,
                                             const Point& point, const Photo& photo,
                                             const PictureLoss& loss, const Evaluation& how) {
  const Camera camera = camera_of(scene, photo);  // before the picture changes the alignment
  const Colorf fixed = gain_of(photo, point);
  Colorf gain;
  const auto render =
      has_image(scene, vertices.instance) ? render_fixed_normals_gradient : render_shape_gradient;
  ShapeGradient found = render(
      lit_for(photo, scene), camera, vertices.instance, vertices.normals,
      settings_of(photo, how.spp, how.seed),
      [&](const Film& rendered) {
        Film film = rendered;
        apply_gain(fixed, film);
        find_gain(photo, film);
        apply_gain(found_gain(photo), film);
        find_alignment(photo, film);
        gain = fixed * found_gain(photo);
        Picture slope = loss(film);
        scale(slope, gain);
        return slope;
      },
      progress_);
  apply_gain(gain, found.film);
  counts_->add(found.film, photo);
  counts_->samples += static_cast<std::int64_t>(rendered_count(photo)) * how.spp;
  return found;
}

CoverageGradient PhotoEvaluator::coverage_gradient(const Scene& scene,
                                                   const MovableVertices& vertices,
                                                   const Photo& photo, const CoverageLoss& loss,
                                                   const Evaluation& how) {
  RenderSettings settings = settings_of(photo, how.spp, how.seed);
  settings.pixels = nullptr;
  CoverageGradient found = render_coverage_gradient(scene, camera_of(scene, photo),
                                                    vertices.instance, settings, loss, progress_);
  counts_->cpu_seconds += found.cpu_seconds;
  return found;
}

FieldJacobian PhotoEvaluator::field_jacobian(const Point& point, const Photo& photo,
                                             const Fields& fields,
                                             const std::vector<float>& weights, int cell,
                                             const Evaluation& how) {
  const Scene scene = scene_of(photo, point);
  FieldJacobian found =
      render_field_jacobian(scene, camera_of(scene, photo), fields.carried(),
                            settings_of(photo, how.spp, how.seed), weights, cell, progress_);
  counts_->add(found.film, photo);
  const Colorf fixed = gain_of(photo, point);
  apply_gain(fixed, found.film);
  find_gain(photo, found.film);
  apply_gain(found_gain(photo), found.film);
  find_alignment(photo, found.film);
  scale_fields(fixed * found_gain(photo), photo, fields, found);
  return found;
}

}  // namespace selenite
