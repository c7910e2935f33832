// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/weights.h"

#include <algorithm>

namespace selenite {
namespace {

constexpr double kDimShare = 0.3;  ///< of the mean, added to a pixel's brightness
constexpr int kBlurRadius = 2;

}  // namespace

Eigen::VectorXf brightness(const Capture& capture) {
  Eigen::VectorXf level(static_cast<Eigen::Index>(3 * capture.size()));
  double mean = 0;
  for (std::size_t i = 0; i < capture.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      const float value = std::max(capture.reference[i][c], 0.f);
      level[static_cast<Eigen::Index>(3 * i) + c] = value;
      mean += capture.share(i) * value;
    }
  constexpr double kBlack = 1e-6;
  return box_blur(level, capture.width, capture.height, kBlurRadius).array() +
         static_cast<float>(kDimShare * std::max(mean, kBlack));
}

Eigen::VectorXf shares(const Capture& capture, std::size_t captures) {
  Eigen::VectorXf share(static_cast<Eigen::Index>(3 * capture.size()));
  for (std::size_t i = 0; i < capture.size(); ++i)
    share.segment<3>(static_cast<Eigen::Index>(3 * i))
        .setConstant(static_cast<float>(capture.share(i) / static_cast<double>(captures)));
  return share;
}

Eigen::VectorXf relative_weights(const Capture& capture, std::size_t captures) {
  return shares(capture, captures).cwiseQuotient(brightness(capture).cwiseAbs2());
}

Eigen::VectorXf box_blur(const Eigen::VectorXf& column, int width, int height, int radius) {
  // Separable, with running sums; at the border the mean is over what lies inside.
  const auto pass = [radius](const Eigen::VectorXf& in, int lines, Eigen::Index line_step,
                             int count, Eigen::Index step) {
    Eigen::VectorXf out(in.size());
    for (int line = 0; line < lines; ++line) {
      const auto at = [&](int i) { return 3 * (line * line_step + i * step); };
      Color<double> sum;
      const auto add = [&](int i, double sign) {
        for (int c = 0; c < 3; ++c) sum[c] += sign * static_cast<double>(in[at(i) + c]);
      };
      for (int i = 0; i < std::min(radius, count); ++i) add(i, 1);
      for (int i = 0; i < count; ++i) {
        if (i + radius < count) add(i + radius, 1);
        if (i - radius > 0) add(i - radius - 1, -1);
        const int inside = std::min(i + radius, count - 1) - std::max(i - radius, 0) + 1;
        for (int c = 0; c < 3; ++c) out[at(i) + c] = static_cast<float>(sum[c] / inside);
      }
    }
    return out;
  };
  return pass(pass(column, height, width, width, 1), width, 1, height, width);
}

}  // namespace selenite
