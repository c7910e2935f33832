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
  // Separable; at the border the mean is over what lies inside.
  const auto pass = [radius](const Eigen::VectorXf& in, int lines, Eigen::Index line_step,
                             int count, Eigen::Index step) {
    Eigen::VectorXf out(in.size());
    for (int line = 0; line < lines; ++line)
      for (int i = 0; i < count; ++i) {
        const int first = std::max(i - radius, 0), last = std::min(i + radius, count - 1);
        const Eigen::Index at = line * line_step;
        for (Eigen::Index c = 0; c < 3; ++c) {
          float sum = 0;
          for (int j = first; j <= last; ++j) sum += in[3 * (at + j * step) + c];
          out[3 * (at + i * step) + c] = sum / static_cast<float>(last - first + 1);
        }
      }
    return out;
  };
  return pass(pass(column, height, width, width, 1), width, 1, height, width);
}

}  // namespace selenite
