// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/clustered_scores.h"

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

#include "fit/inference/confidence.h"

namespace selenite {
namespace {

constexpr std::array kStudent95{6.3138, 2.9200, 2.3534, 2.1318, 2.0150,
                                1.9432, 1.8946, 1.8595, 1.8331};
constexpr std::array kChiSquare99{6.635,  9.210,  11.345, 13.277, 15.086,
                                  16.812, 18.475, 20.090, 21.666};

/// By how much the jackknife that deletes photos scatters more by chance, where few of them rule: with it
/// 1 to 2 % of intervals of independent pixels are widened, of 3 to 8 photos whose shares are at random.
constexpr double kByChance = 4;

}  // namespace

double student_quantile_95(std::size_t freedom) {
  if (freedom <= kStudent95.size()) return kStudent95[std::max<std::size_t>(freedom, 1) - 1];
  // Cornish and Fisher's expansion, to the second order.
  const double z = kQuantile90, n = static_cast<double>(freedom);
  return z + (std::pow(z, 3) + z) / (4 * n) +
         (5 * std::pow(z, 5) + 16 * std::pow(z, 3) + 3 * z) / (96 * n * n);
}

double chi_square_ratio_99(std::size_t freedom) {
  const double n = static_cast<double>(std::max<std::size_t>(freedom, 1));
  if (freedom <= kChiSquare99.size()) return kChiSquare99[static_cast<std::size_t>(n) - 1] / n;
  // Wilson and Hilferty.
  return std::pow(1 - 2 / (9 * n) + 2.3263 * std::sqrt(2 / (9 * n)), 3);
}

void ClusteredScores::begin_photo(const Photo& photo) {
  const int longer = std::max(photo.width, photo.height);
  width_ = photo.width;
  side_ = std::max((longer + options_.blocks - 1) / options_.blocks, options_.least_side);
  columns_ = (photo.width + side_ - 1) / side_;
  const int rows = (photo.height + side_ - 1) / side_;
  first_block_ = blocks_.size();
  blocks_.resize(first_block_ + static_cast<std::size_t>(columns_) * rows, Cluster(n_));
  photos_.emplace_back(n_);
}

void ClusteredScores::add(std::size_t pixel, const Vector& score, const Eigen::MatrixXd& normal) {
  const int x = static_cast<int>(pixel) % width_, y = static_cast<int>(pixel) / width_;
  Cluster& block =
      blocks_[first_block_ + static_cast<std::size_t>(y / side_ * columns_ + x / side_)];
  for (Cluster* one : {&block, &photos_.back()}) {
    one->score += score;
    one->normal += normal;
  }
}

/// By how much the step changes without a cluster that moves it by `moves` and has the share `leverage`
/// of the normal matrix. What it alone shows cannot be judged by the others: its share counts as less
/// than one.
Vector ClusteredScores::deleted(const Vector& moves, const Eigen::MatrixXd& leverage) const {
  const Eigen::Index n = moves.size();
  const Eigen::JacobiSVD<Eigen::MatrixXd> rest(Eigen::MatrixXd::Identity(n, n) - leverage,
                                               Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vector share = rest.singularValues().cwiseMax(1 - options_.most_leverage);
  return rest.matrixV() * (rest.matrixU().transpose() * moves).cwiseQuotient(share);
}

Vector ClusteredScores::variance_of_photos(const std::vector<Eigen::Index>& free,
                                           const Eigen::MatrixXd& inverse,
                                           const Vector& step) const {
  Vector sum = Vector::Zero(inverse.rows()), squares = sum;
  double count = 0;
  for (const Cluster& one : photos_) {
    if ((one.score.array() == 0).all()) continue;
    const Eigen::MatrixXd normal = one.normal(free, free);
    const Vector change = deleted(inverse * (one.score(free) + normal * step), inverse * normal);
    sum += change;
    squares += change.cwiseAbs2();
    ++count;
  }
  if (count < 2) return Vector::Zero(sum.size());
  return (squares - sum.cwiseAbs2() / count).cwiseMax(0) * ((count - 1) / count);
}

Vector ClusteredScores::variance_of(const std::vector<Cluster>& clusters,
                                    const std::vector<Eigen::Index>& free,
                                    const Eigen::MatrixXd& inverse, const Vector& step) const {
  Vector sum = Vector::Zero(inverse.rows()), squares = sum;
  double count = 0;
  for (const Cluster& one : clusters) {
    if ((one.score.array() == 0).all()) continue;  // nothing of it counts
    const Vector moves = inverse * (one.score(free) + one.normal(free, free) * step);
    sum += moves;
    squares += moves.cwiseAbs2();
    ++count;
  }
  if (count < 2) return Vector::Zero(sum.size());
  return (squares - sum.cwiseAbs2() / count).cwiseMax(0) * (count / (count - 1));
}

Vector ClusteredScores::widening(const std::vector<Eigen::Index>& free,
                                 const Eigen::MatrixXd& inverse, const Vector& step,
                                 const Vector& variance) const {
  Vector widest = Vector::Ones(variance.size());
  const auto widen = [&](const Vector& found, double least_ratio, double quantile) {
    for (Eigen::Index k = 0; k < variance.size(); ++k)
      if (variance[k] > 0 && found[k] > least_ratio * variance[k])
        widest[k] = std::max(widest[k], quantile * std::sqrt(found[k] / variance[k]));
  };
  const auto count = static_cast<double>(std::ranges::count_if(
      blocks_, [](const Cluster& one) { return (one.score.array() != 0).any(); }));
  if (count > 1)
    widen(variance_of(blocks_, free, inverse, step),
          1 + options_.block_sigmas * std::sqrt(2 / count), 1);
  if (photos_.size() < options_.least_photos) return widest;
  const std::size_t freedom = photos_.size() - 1;
  const Vector linear = variance_of(photos_, free, inverse, step);
  const Vector without = variance_of_photos(free, inverse, step);
  for (Eigen::Index k = 0; k < variance.size(); ++k) {
    const double chance = chi_square_ratio_99(freedom) * variance[k];
    const bool scatters = linear[k] > chance || without[k] > kByChance * chance;
    if (variance[k] > 0 && scatters)
      widest[k] = std::max(widest[k], student_quantile_95(freedom) / kQuantile90 *
                                          std::sqrt(std::max(linear[k], without[k]) / variance[k]));
  }
  return widest;
}

}  // namespace selenite
