// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/local_regression.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>

#include "fit/problem/pixel_weights.h"

namespace selenite {
namespace {

constexpr int kFeatures = 5;
using Features = std::array<Eigen::VectorXf, kFeatures>;
using Normal = Eigen::Matrix<float, kFeatures, kFeatures>;
using Coefficients = Eigen::Matrix<float, kFeatures, 1>;

/// Slopes are central differences; at the border one-sided ones.
Features features_of(const Eigen::VectorXf& picture, int width, int height) {
  Features found;
  found[0] = Eigen::VectorXf::Ones(picture.size());
  found[1] = picture;
  found[2].resize(picture.size());
  found[3].resize(picture.size());
  const auto at = [&](int x, int y) {
    return picture.segment<3>(3 * (static_cast<Eigen::Index>(y) * width + x));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const int left = std::max(x - 1, 0), right = std::min(x + 1, width - 1);
      const int up = std::max(y - 1, 0), down = std::min(y + 1, height - 1);
      const Eigen::Index i = 3 * (static_cast<Eigen::Index>(y) * width + x);
      found[2].segment<3>(i) = (at(right, y) - at(left, y)) / std::max(right - left, 1);
      found[3].segment<3>(i) = (at(x, down) - at(x, up)) / std::max(down - up, 1);
    }
  found[4] = box_blur(picture, width, height, 1) - picture;
  return found;
}

/// Of a few rows at once.
Eigen::MatrixXf regression(const Eigen::MatrixXf& columns, const Eigen::VectorXf& picture,
                           const Eigen::VectorXf& weight, int width, int height,
                           const LocalRegressionOptions& options) {
  const auto around = [&](const Eigen::VectorXf& x) {
    return box_blur(x, width, height, options.radius);
  };
  const Eigen::Index count = picture.size();
  const Features features = features_of(picture, width, height);
  Features weighted;
  for (std::size_t f = 0; f < kFeatures; ++f) weighted[f] = weight.cwiseProduct(features[f]);
  Eigen::MatrixXf moments(kFeatures * (kFeatures + 1) / 2, count);
  for (std::size_t f = 0, row = 0; f < kFeatures; ++f)
    for (std::size_t g = 0; g <= f; ++g)
      moments.row(static_cast<Eigen::Index>(row++)) =
          around(weighted[f].cwiseProduct(features[g])).transpose();
  Eigen::MatrixXf result(count, columns.cols());
  Eigen::MatrixXf products(kFeatures, count);
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    for (std::size_t f = 0; f < kFeatures; ++f)
      products.row(static_cast<Eigen::Index>(f)) =
          around(weighted[f].cwiseProduct(columns.col(k))).transpose();
    for (Eigen::Index i = 0; i < count; ++i) {
      Normal normal = Normal::Zero();
      for (int f = 0, row = 0; f < kFeatures; ++f)
        for (int g = 0; g <= f; ++g) normal(f, g) = normal(g, f) = moments(row++, i);
      // What a window does not have, as where all its pixels are alike, counts for nothing.
      const Coefficients diagonal = normal.diagonal();
      const Coefficients scale =
          (diagonal.array() > 0).select(diagonal.cwiseMax(1e-30f).cwiseSqrt().cwiseInverse(), 0.f);
      normal = scale.asDiagonal() * normal * scale.asDiagonal();
      normal.diagonal().setConstant(1 + options.ridge);
      const Coefficients found =
          normal.selfadjointView<Eigen::Lower>().llt().solve(scale.cwiseProduct(products.col(i)));
      products.col(i) = scale.cwiseProduct(found);
    }
    result.col(k).setZero();
    for (std::size_t f = 0; f < kFeatures; ++f)
      result.col(k) +=
          features[f].cwiseProduct(around(products.row(static_cast<Eigen::Index>(f)).transpose()));
  }
  return result;
}

}  // namespace

Eigen::MatrixXf local_regression(const Eigen::MatrixXf& columns, const Eigen::VectorXf& picture,
                                 const Eigen::VectorXf& weight, int width, int height,
                                 const LocalRegressionOptions& options) {
  // Of windows that reach into the strip, and the pixels beside these.
  const int margin = 2 * options.radius + 1;
  const Eigen::Index line = 3 * static_cast<Eigen::Index>(width);
  Eigen::MatrixXf result(columns.rows(), columns.cols());
  for (int top = 0; top < height; top += options.strip) {
    const int bottom = std::min(top + options.strip, height);
    const int first = std::max(top - margin, 0), last = std::min(bottom + margin, height);
    const Eigen::Index begin = line * first, count = line * (last - first);
    result.middleRows(line * top, line * (bottom - top)) =
        regression(columns.middleRows(begin, count), picture.segment(begin, count),
                   weight.segment(begin, count), width, last - first, options)
            .middleRows(line * (top - first), line * (bottom - top));
  }
  return result;
}

}  // namespace selenite
