// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/shape_descent.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fit/evaluate/seeds.h"
#include "fit/objective/photo_weights.h"
#include "math/scalar.h"
#include "render/shape/fixed_normals.h"

namespace selenite {
namespace {

const Mesh& mesh_of(const Scene& scene, int instance) {
  const Geometry& geometry = *scene.geometry;
  const Instance& placed = geometry.instances()[static_cast<std::size_t>(instance)];
  return geometry.meshes()[static_cast<std::size_t>(placed.mesh)];
}

std::vector<Vec3f> as_positions(const VertexMatrix& m) {
  std::vector<Vec3f> positions;
  positions.reserve(static_cast<std::size_t>(m.rows()));
  for (Eigen::Index i = 0; i < m.rows(); ++i)
    positions.emplace_back(Vec3d{m(i, 0), m(i, 1), m(i, 2)});
  return positions;
}

VertexMatrix as_matrix(const std::vector<Vec3f>& positions) {
  VertexMatrix m(std::ssize(positions), 3);
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    const Vec3f& p = positions[static_cast<std::size_t>(i)];
    m.row(i) << p.x, p.y, p.z;
  }
  return m;
}

void add(const std::vector<Vec3d>& vertices, double share, VertexMatrix& gradient) {
  for (Eigen::Index v = 0; v < gradient.rows(); ++v) {
    const Vec3d& g = vertices[static_cast<std::size_t>(v)];
    gradient.row(v) += Eigen::RowVector3d(g.x, g.y, g.z) * share;
  }
}

/// Over the pixels that count.
double mean_square(const Picture& picture, const Photo& photo) {
  double sum = 0;
  for (std::size_t p = 0; p < picture.size(); ++p)
    for (int c = 0; c < 3; ++c)
      if (photo.weight[p] > 0) sum += photo.share(p) * square(static_cast<double>(picture[p][c]));
  return sum;
}

/// Of vertices, by the areas of their triangles; 0 where these have none.
VertexMatrix normals_of(const VertexMatrix& positions,
                        const std::vector<std::array<int, 3>>& triangles) {
  VertexMatrix normals = VertexMatrix::Zero(positions.rows(), 3);
  for (const auto& [a, b, c] : triangles) {
    const Eigen::RowVector3d ab = positions.row(b) - positions.row(a);
    const Eigen::RowVector3d ac = positions.row(c) - positions.row(a);
    const Eigen::RowVector3d doubled = ab.cross(ac);
    for (const int v : {a, b, c}) normals.row(v) += doubled;
  }
  normals.rowwise().normalize();
  return normals;
}

/// Of a way along the surface, where an image lies on it: the image slides with the vertices.
constexpr double kSliding = 0.3;

/// With a share of what goes along the surface.
VertexMatrix slid_less(const VertexMatrix& ways, const VertexMatrix& normals) {
  const Vector outwards = ways.cwiseProduct(normals).rowwise().sum();
  return ways * kSliding + normals.cwiseProduct(outwards.replicate(1, 3)) * (1 - kSliding);
}

/// Of the smoothness, after a quarter of a fit: the shape of the whole comes first, then details. Where
/// an image lies on the surface, vertices are almost there: from the start.
constexpr double kFinerSmoothness = 0.15, kFinerWithImage = 0.4;

struct Finer {
  int from;      ///< iteration
  double share;  ///< of the smoothness
};
Finer finer_of(bool with_image, int iterations) {
  if (with_image) return {0, kFinerWithImage};
  return {iterations / 4, kFinerSmoothness};
}

/// In standard errors of the difference: the steps are too long then, or the moments mislead.
constexpr double kSurelyWorse = 2;
/// Of the share of a step that is taken: where it led to worse vertices, and to better ones.
constexpr double kShrinkage = 0.5, kGrowth = 1.5;

MeshSmoothing smoothing_of(const Scene& scene, int instance, double smoothness) {
  const Mesh& mesh = mesh_of(scene, instance);
  const std::size_t vertices = mesh.positions.size();
  return {static_cast<int>(vertices), mesh.triangles, smoothness * static_cast<double>(vertices)};
}

}  // namespace

ShapeDescent::ShapeDescent(const FitRun& run, ShapeDescentOptions options)
    : problem_(&run.problem),
      options_(options),
      start_(problem_->scene_at(problem_->start())),
      vertices_{problem_->fields().vertices()->instance,
                VertexNormals(mesh_of(start_, problem_->fields().vertices()->instance))},
      with_image_(has_image(start_, vertices_.instance)),
      smoothing_(smoothing_of(start_, vertices_.instance, options_.smoothness)),
      guard_(mesh_of(start_, vertices_.instance).triangles, vertices_.normals,
             as_matrix(mesh_of(start_, vertices_.instance).positions)),
      positions_(as_matrix(mesh_of(start_, vertices_.instance).positions)),
      coordinates_(smoothing_.apply(positions_)),
      best_(positions_),
      moments_(positions_.rows(), with_image_ ? StepScale::kOfVertices : StepScale::kShared,
               options_.first_decay, options_.second_decay) {
  const UnknownParameter& unknown = problem_->fields().wanted().front();
  const Eigen::RowVector3d low = positions_.colwise().minCoeff();
  const Eigen::RowVector3d high = positions_.colwise().maxCoeff();
  size_ = (high - low).norm();
  for (int axis = 0; axis < 3; ++axis) {
    const double across = high[axis] - low[axis];
    low_[static_cast<std::size_t>(axis)] = low[axis] + unknown.minimum * across;
    high_[static_cast<std::size_t>(axis)] = high[axis] + unknown.maximum * across;
  }
}

Scene ShapeDescent::scene() const {
  return with_vertices(start_, vertices_.instance, vertices_.normals, as_positions(positions_));
}

Vector ShapeDescent::own_positions() const {
  const Transform& to_object = start_.geometry->to_object(vertices_.instance);
  Vector own(3 * positions_.rows());
  for (Eigen::Index i = 0; i < positions_.rows(); ++i) {
    const Vec3d p = to_object.point(Vec3d{positions_(i, 0), positions_(i, 1), positions_(i, 2)});
    own.segment<3>(3 * i) << p.x, p.y, p.z;
  }
  return own;
}

HistoryRow ShapeDescent::observe(FitRun& run, VertexMatrix& gradient) {
  const FitSettings& settings = problem_->settings();
  const std::vector<Photo>& photos = problem_->photos();
  const double share = 1.0 / static_cast<double>(photos.size());
  const Scene here = scene();
  HistoryRow row = run.row(run.point);
  gradient = VertexMatrix::Zero(positions_.rows(), 3);
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const Evaluation how{settings.spp,
                         stream_seed(settings.seed, Stream::kStep, done_, static_cast<int>(i))};
    ShapeGradient found = run.evaluator.shape_gradient(
        here, vertices_, run.point, photos[i],
        [&](const Film& film) {
          LossResult loss = evaluate_loss(problem_->scalars(), i, film);
          row.loss += share * loss.unbiased;
          row.mean_bias += mean_bias(film, photos[i]) * share;
          if (brightness_.size() == i)
            brightness_.push_back(std::max(mean_square(photos[i].reference, photos[i]),
                                           mean_square(film.mean, photos[i])));
          dim_highlights(i, film.mean, loss.slope);
          return std::move(loss.slope);
        },
        how);
    add(found.vertices, share, gradient);
    observe_outline(run, here, i, how, gradient);
    run.previews[i] = std::make_shared<const Picture>(std::move(found.film.mean));
  }
  return row;
}

void ShapeDescent::dim_highlights(std::size_t index, const Picture& shown, Picture& slope) const {
  const Photo& photo = problem_->photos()[index];
  const double usual = options_.bright * std::sqrt(brightness_[index]);
  for (std::size_t p = 0; p < slope.size(); ++p) {
    float top = 0;
    for (int c = 0; c < 3; ++c) top = std::max({top, photo.reference[p][c], shown[p][c]});
    if (top > usual) slope[p] = slope[p] * static_cast<float>(square(usual / top));
  }
}

void ShapeDescent::observe_outline(FitRun& run, const Scene& here, std::size_t index,
                                   const Evaluation& how, VertexMatrix& gradient) const {
  const Photo& photo = problem_->photos()[index];
  double shown = 0;
  for (const float share : photo.coverage) shown += share;
  if (!(shown > 0)) return;
  const auto factor = static_cast<float>(2 * options_.outline * brightness_[index] / shown);
  const CoverageGradient found = run.evaluator.coverage_gradient(
      here, vertices_, photo,
      [&](const std::vector<float>& coverage) {
        std::vector<float> slope(coverage.size());
        for (std::size_t p = 0; p < slope.size(); ++p)
          slope[p] = factor * (coverage[p] - photo.coverage[p]);
        return slope;
      },
      how);
  add(found.vertices, 1.0 / static_cast<double>(problem_->photos().size()), gradient);
}

bool ShapeDescent::validate(FitRun& run, HistoryRow& row) {
  const Validation found = run.validate(run.point);
  // An image that was fitted at another shape explains photos worse at a better one.
  if (with_image_) run.result.best_validation = std::numeric_limits<double>::quiet_NaN();
  if (!run.best.has_start()) run.best.note_start(found);
  run.best.note(row, found, run.result);
  if (run.result.best_iteration == row.iteration) {
    best_ = positions_;
    share_ = std::min(1.0, share_ * kGrowth);
  }
  return is_worse(found, run.best.validation(), kSurelyWorse);
}

void ShapeDescent::return_to_best() {
  share_ *= kShrinkage;
  positions_ = best_;
  coordinates_ = smoothing_.apply(positions_);
  moments_.forget_mean();
  guard_.set(positions_);
}

bool ShapeDescent::step(FitRun& run) {
  const FitSettings& settings = problem_->settings();
  VertexMatrix gradient;
  HistoryRow row = observe(run, gradient);
  const bool worse = done_ % settings.validation_interval == 0 && validate(run, row);
  run.result.history.push_back(std::move(row));
  if (run.stop_if_dropped()) return false;
  if (worse)
    return_to_best();
  else
    move(gradient, run.result.shape_steps);
  run.point.fields[0] = own_positions();
  run.result.fields_last = std::make_shared<FieldValues>(run.point.fields);
  run.result.iterations = ++done_;
  return done_ < settings.iterations || finish(run);
}

bool ShapeDescent::finish(FitRun& run) {
  HistoryRow row = run.row(run.point);
  validate(run, row);
  row.loss = row.validation;
  run.result.history.push_back(std::move(row));
  return false;
}

void ShapeDescent::move(const VertexMatrix& gradient, ShapeSteps& steps) {
  const auto [coarse, finer] = finer_of(with_image_, problem_->settings().iterations);
  if (done_ == coarse) {
    smoothing_ = smoothing_of(start_, vertices_.instance, options_.smoothness * finer);
    coordinates_ = smoothing_.apply(positions_);
    moments_.reset();
    share_ = 1;
  }
  const VertexMatrix normals =
      with_image_ ? normals_of(positions_, mesh_of(start_, vertices_.instance).triangles)
                  : VertexMatrix();
  const VertexMatrix direction =
      moments_.add(with_image_ ? slid_less(gradient, normals) : gradient, smoothing_);
  if (direction.size() == 0) return;
  const double turn = std::cos(std::numbers::pi * done_ / problem_->settings().iterations);
  const double rate = problem_->fields().wanted().front().learning_rate;
  const double length =
      share_ * size_ * rate * (options_.last_step + (1 - options_.last_step) * (1 + turn) / 2);
  const VertexMatrix way = direction * -length;
  const double farthest =
      (smoothing_.solve(coordinates_ + way) - positions_).rowwise().norm().maxCoeff();
  double share = farthest > length ? length / farthest : 1;
  bool turned = false, crossed = false;
  for (int i = 0; i <= options_.halvings; ++i, share /= 2) {
    VertexMatrix there = smoothing_.solve(coordinates_ + way * share);
    if (with_image_) there = positions_ + slid_less(there - positions_, normals);
    for (int axis = 0; axis < 3; ++axis)
      there.col(axis) = there.col(axis)
                            .cwiseMax(low_[static_cast<std::size_t>(axis)])
                            .cwiseMin(high_[static_cast<std::size_t>(axis)]);
    hold_back(there, turned, crossed);
    const FaceGuard::Verdict verdict = guard_.move_to(there);
    turned = turned || verdict == FaceGuard::Verdict::kTurned;
    crossed = crossed || verdict == FaceGuard::Verdict::kCrossed;
    if (verdict != FaceGuard::Verdict::kGood) continue;
    positions_ = std::move(there);
    coordinates_ = smoothing_.apply(positions_);
    steps.turning += turned;
    steps.intersecting += crossed;
    return;
  }
  steps.turning += turned;
  steps.intersecting += crossed;
  ++steps.given_up;
  moments_.forget_mean();
}

void ShapeDescent::hold_back(VertexMatrix& there, bool& turned, bool& crossed) const {
  for (int round = 0; round <= 4 * options_.halvings; ++round) {
    std::vector<int> stopped = guard_.turning(there);
    turned = turned || !stopped.empty();
    if (stopped.empty()) {
      stopped = guard_.crossing(there);
      crossed = crossed || !stopped.empty();
    }
    if (stopped.empty()) return;
    const bool all_stay =
        std::ranges::all_of(stopped, [&](int v) { return there.row(v) == positions_.row(v); });
    if (all_stay) stopped = guard_.around(stopped);  // a face turns from what surrounds it, too
    for (const int v : stopped)
      there.row(v) = round < options_.halvings
                         ? Eigen::RowVector3d((there.row(v) + positions_.row(v)) / 2)
                         : Eigen::RowVector3d(positions_.row(v));
  }
}

double ShapeDescent::fraction() const {
  return static_cast<double>(done_) / problem_->settings().iterations;
}

void ShapeDescent::members(SavedState& state) {
  const Eigen::Index count = positions_.rows();
  state(positions_, coordinates_, best_, moments_, brightness_, done_, share_);
  if (positions_.rows() != count)
    throw Refused("",
                  "The saved state is of a mesh with " + std::to_string(positions_.rows()) +
                      " vertices, this one has " + std::to_string(count),
                  "start without it");
  if (!state.reading()) return;
  guard_.set(positions_);
  const auto [coarse, finer] = finer_of(with_image_, problem_->settings().iterations);
  if (done_ > coarse)
    smoothing_ = smoothing_of(start_, vertices_.instance, options_.smoothness * finer);
}

void ShapeDescent::plan(RenderPlan& plan) {
  const FitSettings& settings = plan.problem.settings();
  plan.add(PhaseKind::kShape, plan.pixels, settings.spp, settings.iterations,
           Carried::kShapeDerivatives);
  const int interval = settings.validation_interval;
  plan.validate(PhaseKind::kShape, (settings.iterations + interval - 1) / interval + 1);
}

}  // namespace selenite
