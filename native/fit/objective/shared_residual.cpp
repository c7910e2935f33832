// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/objective/shared_residual.h"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "fit/problem/pixel_weights.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/shared_pixels.h"

namespace selenite {
namespace {

/// Each pair of neighbours once: from one of them to the other, in x and y.
constexpr std::array<std::pair<int, int>, 4> kForward{{{1, 0}, {-1, 1}, {0, 1}, {1, 1}}};

/// Calls `of(i, j)` for each pair of neighbouring pixels that both count. Where neighbours share pixels of
/// the photo's file, and with them its noise, the next but one take their place.
template <class OfPair>
void for_pairs(const Photo& photo, OfPair&& of) {
  const int step = shares_pixels(photo) ? 2 : 1;
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x)
      for (const auto& [dx, dy] : kForward) {
        const int p = x + step * dx, q = y + step * dy;
        if (p < 0 || p >= photo.width || q >= photo.height) continue;
        const auto i = static_cast<std::size_t>(y) * photo.width + x;
        const auto j = static_cast<std::size_t>(q) * photo.width + p;
        if (photo.weight[i] != 0 && photo.weight[j] != 0) of(i, j);
      }
}

}  // namespace

void SharedResidual::add(const Photo& photo, const Eigen::VectorXf& half_a,
                         const Eigen::VectorXf& half_b, const Eigen::VectorXf& weights) {
  brightness += weights.cast<double>().dot(selenite::brightness(photo).cwiseAbs2().cast<double>());
  std::vector<int> neighbours(photo.size());
  for_pairs(photo, [&](std::size_t i, std::size_t j) {
    ++neighbours[i];
    ++neighbours[j];
  });
  const auto product = [&](std::size_t i, std::size_t j) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto one = static_cast<Eigen::Index>(3 * i + c);
      const auto other = static_cast<Eigen::Index>(3 * j + c);
      sum += static_cast<double>(weights[one] * half_a[one]) * static_cast<double>(half_b[other]);
    }
    return sum / neighbours[i];
  };
  for_pairs(photo, [&](std::size_t i, std::size_t j) {
    const double both = product(i, j) + product(j, i);
    square += both;
    variance += both * both;
  });
}

double SharedResidual::relative_error() const {
  return brightness > 0 ? std::sqrt(variance) / brightness : 0;
}

void SharedResidual::members(SavedState& state) { state(square, variance, brightness); }

}  // namespace selenite
