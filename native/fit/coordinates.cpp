// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/coordinates.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

// Facts sheet "estimators", Q2, step 1, has 0.4 for log roughness. Measured on a glass sphere at 64
// x 64 and 16 spp, that overshoots into low roughness, where noise holds it, in 2 of 10 seeds; 0.25
// in none of 8.
constexpr double kCapLog = 0.25, kCapLogExcess = 0.2, kCapLinear = 0.3;
/// Smallest argument of log(x - 1 + shift): closer to 1 an index of refraction shows in nothing.
constexpr double kLeastExcess = 0.05;
/// Shift of log(x + shift), as a share of the upper bound, where the lower bound is 0.
constexpr double kShiftAtZero = 1e-3;

}  // namespace

Coordinates::Coordinates(const Unknowns& unknowns) : cap_(unknowns.size()) {
  for (int k = 0; k < unknowns.size(); ++k) {
    const double minimum = unknowns.minimum()[k], maximum = unknowns.maximum()[k];
    switch (unknowns.description_of(k).coordinate) {
      case Coordinate::kLog:
        axes_.push_back({true, minimum > 0 ? 0 : kShiftAtZero * maximum - minimum});
        cap_[k] = kCapLog;
        break;
      case Coordinate::kLogExcess:
        axes_.push_back({true, std::max(kLeastExcess - minimum, -1.0)});
        cap_[k] = kCapLogExcess;
        break;
      default:
        axes_.push_back({false, 0});
        cap_[k] = kCapLinear * (maximum - minimum);
    }
  }
  minimum_ = from_values(unknowns.minimum());
  maximum_ = from_values(unknowns.maximum());
}

Vector Coordinates::from_values(const Vector& x) const {
  Vector u = x;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].logarithmic)
      u[static_cast<Eigen::Index>(k)] = std::log(x[static_cast<Eigen::Index>(k)] + axes_[k].shift);
  return u;
}

Vector Coordinates::to_values(const Vector& u) const {
  Vector x = u;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].logarithmic)
      x[static_cast<Eigen::Index>(k)] = std::exp(u[static_cast<Eigen::Index>(k)]) - axes_[k].shift;
  return x;
}

Vector Coordinates::slope(const Vector& x) const {
  Vector slope = Vector::Ones(x.size());
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].logarithmic)
      slope[static_cast<Eigen::Index>(k)] = x[static_cast<Eigen::Index>(k)] + axes_[k].shift;
  return slope;
}

}  // namespace selenite
