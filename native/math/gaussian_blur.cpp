// SPDX-License-Identifier: GPL-3.0-or-later
#include "math/gaussian_blur.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// A narrower Gaussian leaves a neighbour 4e-6 of the weight: less than single precision resolves.
constexpr double kLeastSigma = 0.2;

/// Weights of the neighbours 0, 1, 2, ... on either side.
std::vector<double> weights_of(double sigma) {
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i <= std::ceil(3 * sigma); ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += (i == 0 ? 1 : 2) * weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

}  // namespace

std::vector<double> gaussian_blur(std::vector<double> picture, std::ptrdiff_t height,
                                  std::ptrdiff_t width, int channels, double sigma, bool repeats) {
  if (sigma < kLeastSigma) return picture;
  const std::vector<double> weights = weights_of(sigma);
  const auto reach = static_cast<std::ptrdiff_t>(weights.size()) - 1;
  std::vector<double> other(picture.size());
  /// Along lines of `count` pixels that are `step` numbers apart.
  const auto along = [&](std::ptrdiff_t lines, std::ptrdiff_t line_step, std::ptrdiff_t count,
                         std::ptrdiff_t step) {
    const auto inside = [&](std::ptrdiff_t i) {
      return repeats ? ((i % count) + count) % count : std::clamp<std::ptrdiff_t>(i, 0, count - 1);
    };
    for (std::ptrdiff_t line = 0; line < lines; ++line)
      for (std::ptrdiff_t i = 0; i < count; ++i)
        for (int c = 0; c < channels; ++c) {
          const double* first = picture.data() + line * line_step + c;
          double sum = weights[0] * first[i * step];
          for (std::ptrdiff_t k = 1; k <= reach; ++k)
            sum += weights[static_cast<std::size_t>(k)] *
                   (first[inside(i - k) * step] + first[inside(i + k) * step]);
          other[static_cast<std::size_t>(line * line_step + i * step + c)] = sum;
        }
    picture.swap(other);
  };
  along(height, width * channels, width, channels);
  along(width, channels, height, width * channels);
  return picture;
}

}  // namespace selenite
