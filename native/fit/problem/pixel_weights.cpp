// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/pixel_weights.h"

#include <algorithm>
#include <cstdlib>

#include "fit/problem/shared_pixels.h"

namespace selenite {
namespace {

/// How many of 2 `radius` + 1 in a row, i the middle one, lie within `count`.
int inside(int i, int count, int radius) {
  return std::min(i + radius, count - 1) - std::max(i - radius, 0) + 1;
}

}  // namespace

double mean_brightness(const Photo& photo) {
  double mean = 0;
  for (std::size_t i = 0; i < photo.size(); ++i)
    for (int c = 0; c < 3; ++c) mean += photo.share(i) * std::max(photo.reference[i][c], 0.f);
  return mean;
}

Eigen::VectorXf brightness(const Photo& photo, const PixelWeightsOptions& options) {
  Eigen::VectorXf level(static_cast<Eigen::Index>(3 * photo.size()));
  for (std::size_t i = 0; i < photo.size(); ++i)
    for (int c = 0; c < 3; ++c)
      level[static_cast<Eigen::Index>(3 * i) + c] = std::max(photo.reference[i][c], 0.f);
  return mean_around(level, photo, options.radius).cwiseMax(0.f).array() +
         static_cast<float>(options.dim_share * std::max(mean_brightness(photo), options.black));
}

Eigen::VectorXf shares(const Photo& photo, std::size_t photos) {
  Eigen::VectorXf share(static_cast<Eigen::Index>(3 * photo.size()));
  for (std::size_t i = 0; i < photo.size(); ++i)
    share.segment<3>(static_cast<Eigen::Index>(3 * i))
        .setConstant(static_cast<float>(photo.share(i) / static_cast<double>(photos)));
  return share;
}

Eigen::VectorXf relative_weights(const Photo& photo, std::size_t photos,
                                 const PixelWeightsOptions& options) {
  return shares(photo, photos).cwiseQuotient(brightness(photo, options).cwiseAbs2());
}

Eigen::VectorXf residual_variance(const Photo& photo, const Eigen::VectorXf& variance,
                                  const PixelWeightsOptions& options) {
  const Eigen::VectorXf model =
      brightness(photo, options) * static_cast<float>(options.model_error);
  return variance / static_cast<float>(options.final_samples) + model.cwiseAbs2();
}

Eigen::VectorXf noise_weights(const Photo& photo, std::size_t photos,
                              const Eigen::VectorXf& variance, const PixelWeightsOptions& options) {
  return shares(photo, photos).cwiseQuotient(residual_variance(photo, variance, options));
}

Eigen::VectorXf mean_around(const Eigen::VectorXf& level, const Photo& photo, int radius) {
  // Sums over the others themselves: the pixel's own number would leave its rounding in a difference.
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * photo.width + x; };
  Eigen::VectorXf out = level;
  const int own = shares_pixels(photo) ? 1 : 0;
  const auto is_own = [&](int across, int down) {
    return std::abs(across) <= own && std::abs(down) <= own;
  };
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      Eigen::Array3d sum = Eigen::Array3d::Zero();
      int count = 0;
      for (int q = std::max(y - radius, 0); q <= std::min(y + radius, photo.height - 1); ++q)
        for (int p = std::max(x - radius, 0); p <= std::min(x + radius, photo.width - 1); ++p) {
          if (is_own(p - x, q - y) || photo.weight[at(p, q)] == 0) continue;
          sum += level.segment<3>(static_cast<Eigen::Index>(3 * at(p, q))).array().cast<double>();
          ++count;
        }
      if (count > 0)
        out.segment<3>(static_cast<Eigen::Index>(3 * at(x, y))) = (sum / count).cast<float>();
    }
  return out;
}

Eigen::VectorXf box_blur(const Eigen::VectorXf& column, int width, int height, int radius) {
  // Separable, with running sums over columns of pixels, then of rows (whole lines at a time);
  // at the border the mean is over what lies inside.
  const Eigen::Index line = 3 * static_cast<Eigen::Index>(width);
  Eigen::VectorXf rows(column.size()), out(column.size());
  for (int y = 0; y < height; ++y) {
    const auto at = [&](int x) { return line * y + 3 * x; };
    Eigen::Array3d sum = Eigen::Array3d::Zero();
    const auto pixel = [&](int x) { return column.segment<3>(at(x)).array().cast<double>(); };
    for (int x = 0; x < std::min(radius, width); ++x) sum += pixel(x);
    for (int x = 0; x < width; ++x) {
      if (x + radius < width) sum += pixel(x + radius);
      if (x - radius > 0) sum -= pixel(x - radius - 1);
      rows.segment<3>(at(x)) = (sum / inside(x, width, radius)).cast<float>();
    }
  }
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(line);
  const auto row = [&](int y) { return rows.segment(line * y, line).array().cast<double>(); };
  for (int y = 0; y < std::min(radius, height); ++y) sum += row(y);
  for (int y = 0; y < height; ++y) {
    if (y + radius < height) sum += row(y + radius);
    if (y - radius > 0) sum -= row(y - radius - 1);
    out.segment(line * y, line) = (sum / inside(y, height, radius)).cast<float>();
  }
  return out;
}

}  // namespace selenite
