// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/shape/shape_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fit/photo/photo_render.h"
#include "fit/problem/loss.h"
#include "math/fault.h"
#include "math/problem_list.h"

namespace selenite {
namespace {

/// Decay of the two moments, as for Adam.
constexpr double kFirst = 0.9, kSecond = 0.999;
/// What is left of the length of a step at the end.
constexpr double kLastStep = 0.05;
/// How often a step is halved before it is given up.
constexpr int kHalvings = 6;
/// A face lies at most 78 degrees off the surface that its smoothed neighbours make.
constexpr double kLeastCosine = 0.2;

Vec3d row(const VertexMatrix& m, int i) { return {m(i, 0), m(i, 1), m(i, 2)}; }

std::vector<Vec3f> as_positions(const VertexMatrix& m) {
  std::vector<Vec3f> positions;
  positions.reserve(static_cast<std::size_t>(m.rows()));
  for (int i = 0; i < m.rows(); ++i) positions.emplace_back(row(m, i));
  return positions;
}

VertexMatrix as_matrix(const std::vector<Vec3f>& positions) {
  VertexMatrix m(static_cast<Eigen::Index>(positions.size()), 3);
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    const Vec3f& p = positions[static_cast<std::size_t>(i)];
    m.row(i) << p.x, p.y, p.z;
  }
  return m;
}

}  // namespace

ShapeFit::ShapeFit(Scene scene, std::vector<Photo> photos, UnknownVertices unknown,
                   FitSettings settings)
    : scene_(std::move(scene)),
      photos_(std::move(photos)),
      unknown_(std::move(unknown)),
      settings_(std::move(settings)),
      instance_(movable_object(scene_, unknown_.object)) {
  settings_.check();
  check_photos(scene_, photos_);
  check();
  const Mesh& mesh = scene_.geometry->meshes()[scene_.geometry->instances()[instance_].mesh];
  normals_ = std::make_unique<VertexNormals>(mesh);
  smoothing_ = std::make_unique<MeshSmoothing>(
      static_cast<int>(mesh.positions.size()), mesh.triangles,
      unknown_.smoothness * static_cast<double>(mesh.positions.size()));
  positions_ = as_matrix(mesh.positions);
  const Eigen::RowVector3d low = positions_.colwise().minCoeff();
  const Eigen::RowVector3d high = positions_.colwise().maxCoeff();
  size_ = (high - low).norm();
  for (int axis = 0; axis < 3; ++axis) {
    const double across = high[axis] - low[axis];
    low_[axis] = low[axis] + unknown_.minimum * across;
    high_[axis] = high[axis] + unknown_.maximum * across;
  }
  best_ = positions_;
  best_loss_ = std::numeric_limits<double>::quiet_NaN();
  coordinates_ = smoothing_->apply(positions_);
  mean_ = squares_ = VertexMatrix::Zero(positions_.rows(), 3);
  faces_ = faces_of(positions_);
  previews_.resize(photos_.size());
  residuals_.resize(photos_.size());
}

void ShapeFit::check() const {
  const std::string who = "Object '" + unknown_.object + "'";
  ProblemList problems;
  const auto require = [&](bool good, const std::string& cause, const std::string& cure) {
    if (!good) problems.add({who, cause, cure});
  };
  require(unknown_.learning_rate > 0 && unknown_.learning_rate <= 1,
          "its learning rate is " + std::to_string(unknown_.learning_rate),
          "give a number above 0 and at most 1");
  require(unknown_.smoothness >= 0 && unknown_.smoothness <= 100,
          "its smoothness is " + std::to_string(unknown_.smoothness), "give a number in [0, 100]");
  require(unknown_.minimum <= 0 && unknown_.maximum >= 0 && unknown_.minimum >= -100 &&
              unknown_.maximum <= 100,
          "its bounds are [" + std::to_string(unknown_.minimum) + ", " +
              std::to_string(unknown_.maximum) + "]",
          "give numbers around 0 in [-100, 100]");
  for (const Photo& photo : photos_)
    if (photo.gain_freedom != GainFreedom::kNone || photo.align)
      problems.add({"Photo '" + photo.id + "'", "its gain or alignment is free",
                    "set both before vertices are fitted"});
  problems.raise();
}

double ShapeFit::evaluate(const Scene& scene, std::size_t index, VertexMatrix* gradient,
                          Color<double>& bias, Progress* progress) {
  const Photo& photo = photos_[index];
  const Loss& loss = find_loss(settings_.loss);
  const Scene lit = photo.lights.applied_to(scene);
  const Camera camera = photo.camera_in(scene);
  const auto seed = settings_.seed + 1000003ull * static_cast<std::uint64_t>(iteration_) +
                    static_cast<std::uint64_t>(index);
  const RenderSettings how =
      render_settings(photo, {settings_.spp, seed, settings_.depth, settings_.threads, 0});
  const Colorf gain(photo.values.gain);
  double value = 0;
  Film seen;
  const auto slope_of = [&](const Film& film) {
    seen = film;
    apply_gain(gain, seen);
    LossResult found = loss.evaluate(seen, photo);
    value = found.unbiased;
    scale(found.slope, gain);
    return std::move(found.slope);
  };
  if (gradient) {
    const ShapeGradient found =
        render_shape_gradient(lit, camera, instance_, *normals_, how, slope_of, progress);
    for (Eigen::Index i = 0; i < gradient->rows(); ++i) {
      const Vec3d& g = found.vertices[static_cast<std::size_t>(i)];
      gradient->row(i) += Eigen::RowVector3d(g.x, g.y, g.z) / static_cast<double>(photos_.size());
    }
    cpu_seconds_ += found.film.cpu_seconds;
  } else {
    const Film film = render(lit, camera, {}, how, progress);
    cpu_seconds_ += film.cpu_seconds;
    (void)slope_of(film);
  }
  samples_ += static_cast<std::int64_t>(how.spp) * how.width * how.height * (gradient ? 2 : 1);
  const Color<double> here = mean_bias(seen, photo);
  bias += here / static_cast<double>(photos_.size());
  double squares = 0;
  for (std::size_t p = 0; p < photo.size(); ++p)
    for (int c = 0; c < 3; ++c)
      squares +=
          photo.share(p) * square(static_cast<double>(seen.mean[p][c] - photo.reference[p][c]));
  residuals_[index] = std::sqrt(squares);
  previews_[index] = std::make_shared<const Picture>(std::move(seen.mean));
  return value / static_cast<double>(photos_.size());
}

bool ShapeFit::step(Progress* progress) {
  if (stopped_ != StopReason::kNone) return false;
  const bool last = iteration_ >= settings_.iterations;
  const Scene scene = with_vertices(scene_, instance_, *normals_, as_positions(positions_));
  VertexMatrix gradient = VertexMatrix::Zero(positions_.rows(), 3);
  double loss = 0;
  Color<double> bias;
  for (std::size_t i = 0; i < photos_.size(); ++i)
    loss += evaluate(scene, i, last ? nullptr : &gradient, bias, progress);
  const Eigen::RowVector3d centre = object_positions(positions_).colwise().mean();
  history_.push_back({iteration_, loss, bias, {centre[0], centre[1], centre[2]}});
  if (!(loss >= best_loss_)) {  // the first is compared with NaN
    best_ = positions_;
    best_loss_ = loss;
    best_iteration_ = iteration_;
  }
  if (last) {
    stop(StopReason::kIterations);
    return false;
  }
  ++iteration_;
  const VertexMatrix smooth = smoothing_->solve(gradient);
  mean_ = mean_ * kFirst + smooth * (1 - kFirst);
  squares_ = squares_ * kSecond + smooth.cwiseAbs2() * (1 - kSecond);
  const double t = iteration_;
  const double first = 1 - std::pow(kFirst, t), second = 1 - std::pow(kSecond, t);
  const double typical = std::sqrt(squares_.maxCoeff() / second);
  if (!(typical > 0) || !std::isfinite(typical)) return true;
  const double turn = std::cos(std::numbers::pi * (t - 1) / settings_.iterations);
  const double length =
      size_ * unknown_.learning_rate * (kLastStep + (1 - kLastStep) * (1 + turn) / 2);
  move(mean_ * (-length / (first * typical)));
  return true;
}

void ShapeFit::move(const VertexMatrix& direction) {
  double share = 1;
  for (int i = 0; i <= kHalvings; ++i, share /= 2) {
    VertexMatrix there = smoothing_->solve(coordinates_ + direction * share);
    for (int axis = 0; axis < 3; ++axis)
      there.col(axis) = there.col(axis).cwiseMax(low_[axis]).cwiseMin(high_[axis]);
    Faces faces = faces_of(there);
    if (turns_over(faces)) continue;
    faces_ = std::move(faces);
    positions_ = std::move(there);
    coordinates_ = smoothing_->apply(positions_);
    return;
  }
  mean_.setZero();  // what led here leads nowhere
}

ShapeFit::Faces ShapeFit::faces_of(const VertexMatrix& positions) const {
  const std::vector<Vec3f> normals = normals_->corner_normals(as_positions(positions));
  const Geometry& geometry = *scene_.geometry;
  const auto& triangles = geometry.meshes()[geometry.instances()[instance_].mesh].triangles;
  Faces faces;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const auto& t = triangles[i];
    const Vec3d a = row(positions, t[0]);
    const Vec3d doubled = cross(row(positions, t[1]) - a, row(positions, t[2]) - a);
    const Vec3d smooth(normals[3 * i] + normals[3 * i + 1] + normals[3 * i + 2]);
    const double sizes = length(doubled) * length(smooth);
    faces.doubled.push_back(doubled);
    faces.cosine.push_back(sizes > 0 ? dot(doubled, smooth) / sizes : -1);
  }
  return faces;
}

bool ShapeFit::turns_over(const Faces& faces) const {
  for (std::size_t i = 0; i < faces.cosine.size(); ++i) {
    if (!(dot(faces.doubled[i], faces_.doubled[i]) > 0)) return true;
    // One that starts so may stay so, and get better.
    if (faces.cosine[i] < kLeastCosine && faces.cosine[i] < faces_.cosine[i]) return true;
  }
  return false;
}

VertexMatrix ShapeFit::object_positions(const VertexMatrix& world) const {
  const Transform& to_object = scene_.geometry->to_object(instance_);
  VertexMatrix own(world.rows(), 3);
  for (int i = 0; i < world.rows(); ++i) {
    const Vec3d p = to_object.point(row(world, i));
    own.row(i) << p.x, p.y, p.z;
  }
  return own;
}

ShapeResult ShapeFit::result() const {
  return {object_positions(best_),
          object_positions(positions_),
          history_,
          iteration_,
          best_iteration_,
          best_loss_,
          residuals_,
          cpu_seconds_,
          samples_};
}

std::string ShapeFit::saved() {
  SavedState state;
  members(state);
  return state.sealed();
}

void ShapeFit::restore(std::string_view saved) {
  SavedState state(saved);
  const Eigen::Index count = positions_.rows();
  members(state);
  state.expect_end();
  if (positions_.rows() != count)
    throw Refused("",
                  "The saved state is of a mesh with " + std::to_string(positions_.rows()) +
                      " vertices, this one has " + std::to_string(count),
                  "start without it");
  faces_ = faces_of(positions_);
}

void ShapeFit::members(SavedState& state) {
  state(positions_, best_, coordinates_, mean_, squares_, iteration_, best_iteration_, best_loss_,
        cpu_seconds_, samples_, history_, residuals_);
}

}  // namespace selenite
