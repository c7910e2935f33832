// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/alignment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "math/scalar.h"

namespace selenite {
namespace {

/// Pixels from the middle of a picture to its corner: a roll moves no pixel farther than that times it.
double reach_of(const Photo& photo) { return std::hypot(photo.width, photo.height) / 2; }

/// Normal matrix of the three, with the prior.
Eigen::Matrix3d normal_of(const AlignmentSlopes& slopes, const Photo& photo,
                          const Eigen::VectorXf& weights) {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> g = slopes.cast<double>();
  Eigen::Matrix3d normal = g.transpose() * weights.cast<double>().asDiagonal() * g;
  const auto count = static_cast<double>(
      3 * std::ranges::count_if(photo.weight, [](float weight) { return weight > 0; }));
  const double prior = 1 / (square(kAlignment.deviation) * count);
  normal.diagonal() += Eigen::Vector3d(prior, prior, prior * square(reach_of(photo)));
  return normal;
}

/// By how much the shifts of a camera change where its picture moves by a pixel.
Vec2<double> shift_of_pixel(Camera camera, int width, int height, const PhotoFrame& frame) {
  const Vec3d ahead = camera.to_world.translation() - camera.to_world.column(2);
  const Vec2<double> before = PixelCamera(camera, width, height, frame).project(ahead);
  camera.shift_x += 1;
  camera.shift_y += 1;
  const Vec2<double> after = PixelCamera(camera, width, height, frame).project(ahead);
  return {1 / (before.x - after.x), 1 / (after.y - before.y)};
}

}  // namespace

Camera Alignment::apply(Camera camera, int width, int height, const PhotoFrame& frame) const {
  if (x == 0 && y == 0 && roll == 0) return camera;
  const Vec2<double> unit = shift_of_pixel(camera, width, height, frame);
  camera.shift_x += x * unit.x;
  camera.shift_y -= y * unit.y;
  const double c = std::cos(roll), s = std::sin(roll);
  for (auto& row : camera.to_world.m) {
    const double right = row[0], up = row[1];
    row[0] = c * right + s * up;
    row[1] = -s * right + c * up;
  }
  return camera;
}

AlignmentSlopes alignment_slopes(const Photo& photo) {
  AlignmentSlopes slopes = AlignmentSlopes::Zero(static_cast<Eigen::Index>(3 * photo.size()), 3);
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * photo.width + x; };
  for (int y = 1; y + 1 < photo.height; ++y)
    for (int x = 1; x + 1 < photo.width; ++x) {
      const std::size_t left = at(x - 1, y), right = at(x + 1, y), up = at(x, y - 1),
                        down = at(x, y + 1);
      bool counts = photo.weight[at(x, y)] > 0;
      for (const std::size_t one : {left, right, up, down})
        counts = counts && photo.weight[one] > 0;
      if (!counts) continue;
      // From the middle of the picture. A roll turns the right side up: content moves the other way.
      const double across = x + 0.5 - photo.width / 2.0, below = y + 0.5 - photo.height / 2.0;
      for (int c = 0; c < 3; ++c) {
        const float dx = (photo.reference[right][c] - photo.reference[left][c]) / 2;
        const float dy = (photo.reference[down][c] - photo.reference[up][c]) / 2;
        slopes.row(static_cast<Eigen::Index>(3 * at(x, y)) + c) << dx, dy,
            static_cast<float>(dx * below - dy * across);
      }
    }
  return slopes;
}

Alignment improved(const Alignment& present, const Film& film, const Photo& photo,
                   const Eigen::VectorXf& weights) {
  const AlignmentSlopes slopes = alignment_slopes(photo);
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const auto pixel = static_cast<std::size_t>(i / 3);
    const int c = static_cast<int>(i % 3);
    const double residual =
        static_cast<double>(film.mean[pixel][c]) - static_cast<double>(photo.reference[pixel][c]);
    right -= static_cast<double>(weights[i]) * residual * slopes.row(i).cast<double>().transpose();
  }
  const Eigen::Vector3d step =
      normal_of(slopes, photo, weights).ldlt().solve(right) * kAlignment.step;
  const auto bounded = [](double value, double most) { return std::clamp(value, -most, most); };
  return {bounded(present.x + step[0], kAlignment.most),
          bounded(present.y + step[1], kAlignment.most),
          bounded(present.roll + step[2], kAlignment.most / reach_of(photo))};
}

void eliminate_alignment(const AlignmentSlopes& slopes, const Photo& photo,
                         const Eigen::VectorXf& weights, Eigen::Ref<Eigen::VectorXf> column) {
  const Eigen::Vector3d common =
      slopes.cast<double>().transpose() * weights.cwiseProduct(column).cast<double>();
  const Eigen::Vector3d share = normal_of(slopes, photo, weights).ldlt().solve(common);
  column -= slopes * share.cast<float>();
}

}  // namespace selenite
