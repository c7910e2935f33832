// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <array>

#include "fit/inference/confidence.h"
#include "fit/problem/reparametrization.h"

namespace selenite {

/// The values around which the photos are taken to be linear, in `Reparametrization`.
struct ExpansionPoint {
  const Unknowns& unknowns;
  const Reparametrization& reparametrization;
  const Vector& u;
  const ConfidenceOptions& options;

  double value(Eigen::Index k) const { return reparametrization.to_value(k, u[k]); }
  /// How far a component may go.
  double range(Eigen::Index k) const {
    return std::min(reparametrization.maximum()[k] - reparametrization.minimum()[k],
                    options.decades);
  }
  bool is_roughness(Eigen::Index k) const {
    return unknowns.description_of(static_cast<int>(k)).scale == Scale::kRoughness;
  }
  /// Inside the bounds.
  double clamped(Eigen::Index k, double coordinate) const {
    return std::clamp(coordinate, reparametrization.minimum()[k], reparametrization.maximum()[k]);
  }
  /// Values of component k at two offsets from u.
  std::array<double, 2> values_between(Eigen::Index k, double low, double high) const {
    return {reparametrization.to_value(k, clamped(k, u[k] + low)),
            reparametrization.to_value(k, clamped(k, u[k] + high))};
  }
};

}  // namespace selenite
