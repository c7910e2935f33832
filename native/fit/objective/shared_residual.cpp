// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/shared_residual.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/problem/pixel_weights.h"
#include "fit/problem/saved_state.h"

namespace selenite {

void SharedResidual::add(const Photo& photo, const Eigen::VectorXf& half_a,
                         const Eigen::VectorXf& half_b, const Eigen::VectorXf& weights) {
  brightness += weights.cast<double>().dot(selenite::brightness(photo).cwiseAbs2().cast<double>());
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * photo.width + x; };
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      if (photo.weight[at(x, y)] == 0) continue;
      std::array<double, 3> around{};
      int count = 0;
      for (int q = std::max(y - 1, 0); q <= std::min(y + 1, photo.height - 1); ++q)
        for (int p = std::max(x - 1, 0); p <= std::min(x + 1, photo.width - 1); ++p) {
          if ((p == x && q == y) || photo.weight[at(p, q)] == 0) continue;
          ++count;
          for (std::size_t c = 0; c < 3; ++c)
            around[c] += half_b[static_cast<Eigen::Index>(3 * at(p, q) + c)];
        }
      if (count == 0) continue;
      double part = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto i = static_cast<Eigen::Index>(3 * at(x, y) + c);
        part += static_cast<double>(weights[i] * half_a[i]) * around[c] / count;
      }
      square += part;
      variance += part * part;
    }
}

double SharedResidual::relative_error() const {
  return brightness > 0 ? std::sqrt(variance) / brightness : 0;
}

void SharedResidual::members(SavedState& state) { state(square, variance, brightness); }

}  // namespace selenite
