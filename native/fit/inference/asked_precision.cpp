// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/asked_precision.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/scalar.h"

namespace selenite {
namespace {

constexpr double kOfValue = 2;  ///< the share of a value, over that of a range

}  // namespace

Vector samples_factors(const Unknowns& unknowns, const Vector& x,
                       const std::vector<Confidence>& components, double share) {
  Vector factors = Vector::Zero(x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const Confidence& one = components[static_cast<std::size_t>(k)];
    if (!one.determined) continue;
    const double range = unknowns.maximum()[k] - unknowns.minimum()[k];
    const bool by_ratio = unknowns.description_of(static_cast<int>(k)).scale == Scale::kLog;
    const double asked = share * std::max(by_ratio ? 0.0 : range, kOfValue * std::abs(x[k]));
    const double squared = square((one.interval[1] - one.interval[0]) / 2 / asked);
    const double lasting = one.lasting * squared;
    factors[k] =
        lasting < 1 ? (squared - lasting) / (1 - lasting) : std::numeric_limits<double>::infinity();
  }
  return factors;
}

}  // namespace selenite
