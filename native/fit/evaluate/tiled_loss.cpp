// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/tiled_loss.h"

#include <algorithm>
#include <cmath>

#include "fit/problem/pixel_weights.h"
#include "math/scalar.h"

namespace selenite {
namespace {

void extend(Eigen::ArrayXd& all, const Eigen::ArrayXd& more) {
  const Eigen::Index before = all.size();
  all.conservativeResize(before + more.size());
  all.tail(more.size()) = more;
}

}  // namespace

TiledLoss::TiledLoss(const Film& film, const Photo& photo, const Eigen::VectorXf& weights,
                     const TiledLossOptions& options) {
  const auto size = static_cast<Eigen::Index>(3 * film.size());
  Eigen::VectorXf half_a(size), half_b(size), own(size);
  for (std::size_t i = 0; i < film.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<Eigen::Index>(3 * i) + c;
      const float root = std::sqrt(weights[k]), reference = photo.reference[i][c];
      half_a[k] = root * (film.half_a[i][c] - reference);
      half_b[k] = root * (film.half_b(film.mean[i], film.half_a[i])[c] - reference);
      own[k] = weights[k] * (square(film.mean[i][c] - reference) - film.variance[i][c]);
    }
  const int longer = std::max(photo.width, photo.height);
  const int radius = std::max(static_cast<int>(std::lround(options.radius * longer)), 1);
  const auto blurred = [&](const Eigen::VectorXf& column) {
    return box_blur(column, photo.width, photo.height, radius);
  };
  const Eigen::VectorXf common = blurred(half_a).cwiseProduct(blurred(half_b));
  // As wide as the blur: beyond that, blurred noise has nothing in common.
  const int tile = 2 * radius + 1, columns = (photo.width + tile - 1) / tile;
  const int rows = (photo.height + tile - 1) / tile;
  coarse = all = Eigen::ArrayXd::Zero(columns * rows);
  for (Eigen::Index k = 0; k < size; ++k) {
    const int pixel = static_cast<int>(k / 3);
    const int at = pixel / photo.width / tile * columns + pixel % photo.width / tile;
    coarse[at] += common[k];
    all[at] += own[k];
  }
}

void TiledLoss::append(const TiledLoss& other, double share) {
  extend(coarse, share * other.coarse);
  extend(all, share * other.all);
}

NoisySum::NoisySum(const Eigen::ArrayXd& terms)
    : sum(terms.sum()), deviation(std::sqrt((terms - terms.mean()).square().sum())) {}

}  // namespace selenite
