// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cmath>

#include "math/scalar.h"

namespace selenite {

/// Nodes and weights of Gauss-Legendre quadrature on [0, 1], found by Newton's method.
template <int kCount>
struct GaussLegendre {
  std::array<double, kCount> x, weight;

  GaussLegendre() {
    for (int i = 0; i < kCount; ++i) {
      double t = std::cos(kPi<double> * (i + 0.75) / (kCount + 0.5)), slope = 0;
      for (int newton = 0; newton < 8; ++newton) {
        double p = 1, q = 0;  // Legendre polynomials of degrees k and k - 1
        for (int k = 1; k <= kCount; ++k) {
          const double r = ((2 * k - 1) * t * p - (k - 1) * q) / k;
          q = p;
          p = r;
        }
        slope = kCount * (t * p - q) / (t * t - 1);
        t -= p / slope;
      }
      x[i] = (1 + t) / 2;
      weight[i] = 1 / ((1 - t * t) * slope * slope);
    }
  }
};

}  // namespace selenite
