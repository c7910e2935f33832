// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate/wiener_filter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/problem/pixel_weights.h"

namespace selenite {
namespace {

/// One channel of a picture.
template <typename Picture>
auto plane(Picture& picture, int channel) {
  return picture(Eigen::seq(channel, Eigen::last, 3));
}

}  // namespace

WienerFilter::Bands WienerFilter::split(const Eigen::VectorXf& picture) const {
  Bands bands;
  bands[0] = picture;
  for (std::size_t i = 0; i < kBlurs; ++i) {
    bands[i + 1] = box_blur(bands[i], width_, height_, options_.radii[i]);
    bands[i] -= bands[i + 1];
  }
  return bands;
}

WienerFilter::WienerFilter(const Eigen::VectorXf& a, const Eigen::VectorXf& b,
                           const Eigen::VectorXf& weight, int width, int height,
                           const WienerFilterOptions& options)
    : width_(width), height_(height), options_(options) {
  const int side = 2 * options_.window_radius + 1;
  const auto count = static_cast<float>(side * side);
  const auto sigmas = static_cast<float>(options_.standard_errors);
  const Bands in_a = split(a), in_b = split(b);
  const auto around = [&](const Eigen::VectorXf& x) {
    return box_blur(x, width, height, options_.window_radius).eval();
  };
  for (std::size_t i = 0; i < in_a.size(); ++i) {
    const Eigen::VectorXf common = weight.cwiseProduct(in_a[i]).cwiseProduct(in_b[i]);
    const Eigen::VectorXf all = weight.cwiseProduct(in_a[i].cwiseAbs2() + in_b[i].cwiseAbs2()) / 2;
    signal_[i] =
        (around(common) - sigmas * (around(common.cwiseAbs2()).cwiseMax(0) / count).cwiseSqrt())
            .cwiseMax(0);
    noise_[i] = (around(all) - signal_[i]).cwiseMax(0);
  }
}

Eigen::VectorXf WienerFilter::filter(const Eigen::VectorXf& picture, float noise) const {
  const Bands bands = split(picture);
  Eigen::VectorXf sum = Eigen::VectorXf::Zero(picture.size());
  for (std::size_t i = 0; i < bands.size(); ++i)
    sum.array() += (signal_[i].array() > 0)
                       .select(bands[i].array() * signal_[i].array() /
                                   (signal_[i].array() + noise * noise_[i].array()),
                               0.f);
  return sum;
}

Eigen::VectorXf clipped_derivative(const Eigen::VectorXf& column, const Photo& photo, int channel,
                                   const WienerFilterOptions& options) {
  std::vector<float> sizes;
  for (Eigen::Index i = 0; i < column.size(); i += options.clip_stride) {
    const bool counts = channel < 0 || i % 3 == channel;
    if (counts && photo.weight[static_cast<std::size_t>(i / 3)] > 0)
      sizes.push_back(std::abs(column[i]));
  }
  if (sizes.empty()) return column;
  const double rank = options.clip_quantile * static_cast<double>(sizes.size() - 1);
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(sizes.begin(), at, sizes.end());
  return column.cwiseMax(-*at).cwiseMin(*at);
}

Eigen::VectorXf filtered_derivative(const Eigen::VectorXf& mean, const Eigen::VectorXf& one,
                                    const Eigen::VectorXf& other, double share, const Photo& photo,
                                    int channel, const Eigen::VectorXf& importance,
                                    const WienerFilterOptions& options) {
  const auto shown = [&](const Eigen::VectorXf& picture) -> Eigen::VectorXf {
    if (channel < 0) return picture;
    return plane(picture, channel);
  };
  const auto clipped = [&](const Eigen::VectorXf& picture) {
    return shown(clipped_derivative(picture, photo, channel, options));
  };
  const WienerFilter filter(clipped(one), clipped(other), shown(importance), photo.width,
                            photo.height, options);
  // In units of the mean variance of the two.
  Eigen::VectorXf result = filter.filter(clipped(mean), static_cast<float>(2 * share));
  if (channel < 0) return result;
  Eigen::VectorXf whole = Eigen::VectorXf::Zero(mean.size());
  plane(whole, channel) = result;
  return whole;
}

}  // namespace selenite
