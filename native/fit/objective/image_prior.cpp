// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/image_prior.h"

#include <algorithm>

namespace selenite {
namespace {

/// Of the curve from held to linear values, on a logarithmic scale.
constexpr double kSrgbExponent = 2.2;

}  // namespace

void add_image_prior(const Texture& image, const Vector& start, const Vector& values,
                     const Vector& moving, const PriorScale& scale, std::vector<double>& gradient,
                     int channels, const ImagePriorOptions& options) {
  if (scale.loss <= 0) return;
  for (int c = 0; c < channels; ++c) {
    const auto channel = [c, channels, n = values.size() / channels](const Vector& all) {
      return all(Eigen::seqN(c, n, channels));
    };
    const double shown = channel(moving).sum();
    const double before = channel(start).dot(channel(moving));
    if (before <= 0) continue;
    const double sum = channel(values).dot(channel(moving));
    const double factor = sum / before, mean = sum / shown;
    if (mean <= 0) continue;
    const double grain = std::min(1.0, scale.count / 3 / shown);  // pixels a texel
    const double sigma = options.deviation * mean / (image.encoded() ? kSrgbExponent : 1);
    const double strength = 2 * scale.loss / scale.count * grain / (sigma * sigma);
    for (Eigen::Index i = c; i < values.size(); i += channels)
      gradient[static_cast<std::size_t>(i)] +=
          strength * moving[i] * (values[i] - factor * start[i]);
  }
}

}  // namespace selenite
