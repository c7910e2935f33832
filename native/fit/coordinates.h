// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fit/unknowns.h"

namespace selenite {

/// Coordinates in which the picture is closest to linear, as the table says
/// (Parameter::coordinate): x, log x or log(x - 1), the logarithms shifted where the bounds reach
/// their pole.
class Coordinates {
 public:
  explicit Coordinates(const Unknowns& unknowns);

  Vector from_values(const Vector& x) const;
  Vector to_values(const Vector& u) const;
  /// dx/du at x, per component.
  Vector slope(const Vector& x) const;

  const Vector& minimum() const { return minimum_; }  ///< of u
  const Vector& maximum() const { return maximum_; }
  /// Farthest that one step may go, per component: what the linear model is trusted for.
  const Vector& cap() const { return cap_; }

 private:
  struct Axis {
    bool logarithmic;
    double shift;  ///< u = log(x + shift)
  };
  std::vector<Axis> axes_;
  Vector minimum_, maximum_, cap_;
};

}  // namespace selenite
