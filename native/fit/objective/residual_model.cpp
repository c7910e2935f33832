// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/residual_model.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/objective/alignment.h"
#include "fit/problem/saved_state.h"
#include "math/scalar.h"

namespace selenite {
namespace {

using Three = Eigen::Vector3d;

/// Normal equations of a least squares problem of three numbers.
struct ThreeEquations {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Three right = Three::Zero();

  void add(const Three& x, double y, double weight) {
    normal += weight * x * x.transpose();
    right += weight * y * x;
  }
  double value(const Three& x) const { return x.dot(normal * x) / 2 - right.dot(x); }

  /// The same with the last number at most `most`: beyond that it is fixed.
  Three solve(double most) const {
    Three free = solve();
    if (free[2] <= most) return free;
    ThreeEquations others = *this;
    others.right -= most * normal.col(2);
    others.normal.row(2).setZero();
    others.normal.col(2).setZero();
    Three x = others.solve();
    x[2] = most;
    return x;
  }
  /// The best of all solutions whose numbers are not below 0: each subset of them may be 0.
  Three solve() const {
    Three best = Three::Zero();
    for (int subset = 1; subset < 8; ++subset) {
      std::vector<int> free;
      for (int k = 0; k < 3; ++k)
        if ((subset >> k & 1) != 0 && normal(k, k) > 0) free.push_back(k);
      if (free.empty()) continue;
      const Eigen::VectorXd scale =
          Eigen::VectorXd(normal.diagonal()(free)).cwiseSqrt().cwiseInverse();
      const Eigen::MatrixXd scaled = scale.asDiagonal() * normal(free, free) * scale.asDiagonal();
      const Eigen::LDLT<Eigen::MatrixXd> solver(scaled);
      if (solver.info() != Eigen::Success || !solver.isPositive()) continue;
      Three x = Three::Zero();
      x(free) = scale.cwiseProduct(solver.solve(scale.cwiseProduct(Eigen::VectorXd(right(free)))));
      if (!x.allFinite() || x.minCoeff() < 0) continue;
      if (value(x) < value(best)) best = x;
    }
    return best;
  }
};

/// Squared slope of the edge that runs through each pixel, 3 numbers a pixel: the product of the slopes on
/// both sides of it, along the direction in which they agree best. A bright pixel of the photo's noise has
/// none, also where an area filter has spread it over neighbours: around it slopes oppose each other.
Eigen::VectorXf squared_edge_slopes(const Photo& photo) {
  const Eigen::MatrixX2f slopes = alignment_slopes(photo).leftCols<2>();
  Eigen::VectorXf squares = Eigen::VectorXf::Zero(slopes.rows());
  const Eigen::Index row = 3 * static_cast<Eigen::Index>(photo.width);
  for (int y = 1; y + 1 < photo.height; ++y)
    for (Eigen::Index i = row * y + 3; i < row * (y + 1) - 3; ++i)
      for (const Eigen::Index side : {Eigen::Index{3}, row - 3, row, row + 3})
        squares[i] = std::max(squares[i], slopes.row(i - side).dot(slopes.row(i + side)));
  return squares;
}

}  // namespace

ErrorScales::ErrorScales(const Photo& photo)
    : relative(brightness(photo).cwiseAbs2()), shift(squared_edge_slopes(photo)) {
  double mean = 0;
  for (std::size_t i = 0; i < photo.size(); ++i)
    for (int c = 0; c < 3; ++c) mean += photo.share(i) * std::max(photo.reference[i][c], 0.f);
  absolute = Eigen::VectorXf::Constant(relative.size(), static_cast<float>(square(mean)));
}

Eigen::VectorXf ErrorScales::variance(const ModelError& error) const {
  return relative * static_cast<float>(square(error.relative)) +
         absolute * static_cast<float>(square(error.absolute)) +
         shift * static_cast<float>(square(error.shift));
}

ResidualModel::ResidualModel(std::span<const PhotoResiduals> photos,
                             const ResidualModelOptions& options)
    : options_(options), of_photos_(photos.size(), 1) {
  std::vector<ErrorScales> scales;
  // At first all alike, which finds the root mean square: from above the scale falls to that of the tails.
  std::vector<Weighing> weighings;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    scales.emplace_back(photos[p].photo);
    weighings.push_back({scales[p].relative, Eigen::VectorXf::Ones(scales[p].relative.size())});
  }
  for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
    ThreeEquations equations;
    for (std::size_t p = 0; p < photos.size(); ++p) {
      const PhotoResiduals& one = photos[p];
      const auto& [variance, tail] = weighings[p];
      for (Eigen::Index i = 0; i < variance.size(); ++i) {
        const double share = one.photo.share(static_cast<std::size_t>(i / 3));
        if (!(share > 0)) continue;
        equations.add(
            {scales[p].relative[i], scales[p].absolute[i], scales[p].shift[i]},
            of_photos_[p] * static_cast<double>(tail[i]) * static_cast<double>(one.product[i]),
            share / square(static_cast<double>(variance[i])));
      }
    }
    const Three squares = equations.solve(square(options_.most_shift)).cwiseSqrt();
    error_ = {squares[0], squares[1], squares[2]};
    for (std::size_t p = 0; p < photos.size(); ++p) weighings[p] = weighing(photos[p], scales[p]);
    weigh_photos(photos, weighings);
  }
}

double ResidualModel::size(std::span<const PhotoResiduals> photos) const {
  double sum = 0;
  for (const PhotoResiduals& one : photos) {
    const ErrorScales scales(one.photo);
    const Eigen::VectorXf ratio = scales.variance(error_).cwiseQuotient(scales.relative);
    for (Eigen::Index i = 0; i < ratio.size(); ++i)
      sum += one.photo.share(static_cast<std::size_t>(i / 3)) * static_cast<double>(ratio[i]);
  }
  return std::sqrt(sum / static_cast<double>(photos.size()));
}

/// (nu + 1) / (nu + q), q the mean of residuals around a pixel in units of their variance.
Eigen::VectorXf ResidualModel::tail(const PhotoResiduals& one,
                                    const Eigen::VectorXf& variance) const {
  const Photo& photo = one.photo;
  Eigen::VectorXf ratio = one.product.cwiseQuotient(variance);
  for (std::size_t i = 0; i < photo.size(); ++i) {
    auto pixel = ratio.segment<3>(static_cast<Eigen::Index>(3 * i));
    pixel.setConstant(pixel.mean());
  }
  const Eigen::ArrayXf q = mean_around(ratio, photo, options_.radius).cwiseMax(0.f).array();
  const auto nu = static_cast<float>(options_.degrees_of_freedom);
  return (nu + 1) / (nu + q);
}

ResidualModel::Weighing ResidualModel::weighing(const PhotoResiduals& one,
                                                const ErrorScales& scales) const {
  Weighing found{one.variance + scales.variance(error_), {}};
  found.tail = tail(one, found.variance);
  return found;
}

/// (nu + n) / (nu + n Q), Q the mean of a photo's weighed residuals: a light that moved is an error of
/// all its pixels.
void ResidualModel::weigh_photos(std::span<const PhotoResiduals> photos,
                                 std::span<const Weighing> weighings) {
  const double nu = options_.degrees_of_freedom, count = options_.count_of_photo;
  double sum = 0;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    const PhotoResiduals& one = photos[p];
    const auto& [variance, tail] = weighings[p];
    const Eigen::VectorXf weighed = tail.cwiseProduct(one.product).cwiseQuotient(variance);
    double mean = 0;
    for (Eigen::Index i = 0; i < weighed.size(); ++i)
      mean += one.photo.share(static_cast<std::size_t>(i / 3)) * static_cast<double>(weighed[i]);
    of_photos_[p] = (nu + count) / (nu + count * std::max(mean, 0.0));
    sum += of_photos_[p];
  }
  for (double& one : of_photos_) one *= static_cast<double>(photos.size()) / sum;
}

Eigen::VectorXf ResidualModel::precision(const PhotoResiduals& one, std::size_t p) const {
  const Weighing found = weighing(one, ErrorScales(one.photo));
  return static_cast<float>(of_photos_.at(p)) * found.tail.cwiseQuotient(found.variance);
}

void ResidualModel::members(SavedState& state) { state(error_, of_photos_); }

}  // namespace selenite
