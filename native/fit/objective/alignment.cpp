// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/alignment.h"

#include <algorithm>
#include <cmath>

#include "fit/objective/half_buffers.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// Pixels from the middle of a picture to its corner: a roll moves no pixel farther than that times it.
double reach_of(const Photo& photo) { return std::hypot(photo.width, photo.height) / 2; }

}  // namespace

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

AlignmentEquations::AlignmentEquations(const Photo& photo, const Eigen::VectorXf& weights)
    : photo_(photo), weights_(weights), slopes_(alignment_slopes(photo)) {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> g = slopes_.cast<double>();
  Eigen::Matrix3d normal = g.transpose() * weights.cast<double>().asDiagonal() * g;
  const auto count = static_cast<double>(
      3 * std::ranges::count_if(photo.weight, [](float weight) { return weight > 0; }));
  const double prior = 1 / (square(kAlignment.deviation) * count);
  normal.diagonal() += Eigen::Vector3d(prior, prior, prior * square(reach_of(photo)));
  normal_.compute(normal);
}

Eigen::Vector3d AlignmentEquations::solve(const Eigen::VectorXf& column) const {
  return normal_.solve(slopes_.cast<double>().transpose() *
                       weights_.cwiseProduct(column).cast<double>());
}

/// A standard deviation in pixels, as a covariance of x, y and roll.
Eigen::Matrix3d AlignmentEquations::spread(double deviation) const {
  const double reach = reach_of(photo_);
  return square(deviation) * Eigen::Vector3d(1, 1, 1 / square(reach)).asDiagonal();
}

AlignmentEstimate AlignmentEquations::prior() const {
  return {photo_.alignment, spread(kAlignment.deviation)};
}

AlignmentEstimate AlignmentEquations::improved(const AlignmentEstimate& present,
                                               const Film& film) const {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> g =
      weights_.cast<double>().asDiagonal() * slopes_.cast<double>();
  const Eigen::VectorXd noise = mean_variance(film).cast<double>();
  const Eigen::Matrix3d inverse = normal_.solve(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d of_render = inverse * (g.transpose() * noise.asDiagonal() * g) * inverse;
  const Eigen::Matrix3d before = present.covariance + spread(kAlignment.drift);
  const Eigen::Matrix3d share = (before + of_render).ldlt().solve(before).transpose();
  const Eigen::Vector3d step = -share * solve(mean_residual(film, photo_));
  const Alignment& given = photo_.alignment;
  const auto bounded = [](double value, double middle, double most) {
    return std::clamp(value, middle - most, middle + most);
  };
  return {{bounded(present.at.x + step[0], given.x, kAlignment.most),
           bounded(present.at.y + step[1], given.y, kAlignment.most),
           bounded(present.at.roll + step[2], given.roll, kAlignment.most / reach_of(photo_))},
          (Eigen::Matrix3d::Identity() - share) * before};
}

void AlignmentEquations::eliminate(Eigen::Ref<Eigen::VectorXf> column) const {
  column -= slopes_ * solve(column).cast<float>();
}

}  // namespace selenite
