// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>

namespace selenite {

/// Numbers against what they should be on average, in standard errors of their mean.
struct Mean {
  double sum = 0, square = 0;
  int n = 0;
  void add(double x) {
    sum += x;
    square += x * x;
    ++n;
  }
  double z(double truth) const {
    const double mean = sum / n;
    return (mean - truth) / std::sqrt((square / n - mean * mean) / (n - 1));
  }
};

}  // namespace selenite
