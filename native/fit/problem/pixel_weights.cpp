// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/problem/pixel_weights.h"

#include <algorithm>
#include <array>
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

namespace {

/// Means along `lines` lines of pixels with `channels` numbers, side by side: the running sum of one
/// line waits for itself.
template <int channels, int lines>
void blur_lines(const float* in, float* out, Eigen::Index line, int width, int radius) {
  std::array<double, static_cast<std::size_t>(channels * lines)> sums{};
  const auto each = [&](auto&& use) {
    for (int r = 0; r < lines; ++r)
      for (int c = 0; c < channels; ++c)
        use(sums[static_cast<std::size_t>(channels * r + c)], line * r + c);
  };
  for (int x = 0; x < std::min(radius, width); ++x)
    each([&](double& sum, Eigen::Index i) { sum += in[i + channels * x]; });
  for (int x = 0; x < width; ++x) {
    if (x + radius < width)
      each([&](double& sum, Eigen::Index i) { sum += in[i + channels * (x + radius)]; });
    if (x - radius > 0)
      each([&](double& sum, Eigen::Index i) { sum -= in[i + channels * (x - radius - 1)]; });
    const double count = inside(x, width, radius);
    each([&](double sum, Eigen::Index i) {
      out[i + channels * x] = static_cast<float>(sum / count);
    });
  }
}

template <int channels>
void blur_across(const float* in, float* out, int width, int height, int radius) {
  constexpr int kTogether = 4;
  const Eigen::Index line = channels * static_cast<Eigen::Index>(width);
  int y = 0;
  for (; y + kTogether <= height; y += kTogether)
    blur_lines<channels, kTogether>(in + line * y, out + line * y, line, width, radius);
  for (; y < height; ++y)
    blur_lines<channels, 1>(in + line * y, out + line * y, line, width, radius);
}

void blur_down(const Eigen::VectorXf& in, Eigen::VectorXf& out, Eigen::Index line, int height,
               int radius) {
  const Eigen::VectorXf none = Eigen::VectorXf::Zero(line);
  const auto row = [&](int y) { return y >= 0 && y < height ? in.data() + line * y : none.data(); };
  Eigen::ArrayXd sums = Eigen::ArrayXd::Zero(line);
  for (int y = 0; y < std::min(radius, height); ++y)
    sums += in.segment(line * y, line).array().cast<double>();
  for (int y = 0; y < height; ++y) {
    const float *below = row(y + radius), *above = row(y - radius - 1);
    float* to = out.data() + line * y;
    const double count = inside(y, height, radius);
    for (Eigen::Index i = 0; i < line; ++i) {
      sums[i] = sums[i] + below[i] - above[i];
      to[i] = static_cast<float>(sums[i] / count);
    }
  }
}

}  // namespace

Eigen::VectorXf box_blur(const Eigen::VectorXf& column, int width, int height, int radius) {
  // Separable, with running sums; at the border the mean is over what lies inside.
  const Eigen::Index line = column.size() / height;
  Eigen::VectorXf across(column.size()), out(column.size());
  const bool gray = line == width;
  (gray ? blur_across<1> : blur_across<3>)(column.data(), across.data(), width, height, radius);
  blur_down(across, out, line, height, radius);
  return out;
}

}  // namespace selenite
