// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "math/statistics.h"

namespace selenite {

/// The slope of a mean at `here` from means at a distance h on both sides; one-sided, and of second
/// order too, where a side leaves [0, top]. `mean(step)`: that of a render so far from here.
template <class Mean>
double difference_slope(float here, float h, float top, const Mean& mean) {
  if (here - h >= 0 && here + h <= top) return (mean(h) - mean(-h)) / (2 * h);
  const float side = here - h < 0 ? 1.f : -1.f;
  return side * (4 * mean(side * h) - 3 * mean(0.f) - mean(2 * side * h)) / (2 * h);
}

/// Twelve pairs of a derivative and a difference, of one seed each: they agree, and say something.
class DifferencePairs {
 public:
  void add(double derivative, double difference) {
    gap_.add(derivative - difference);
    size_.add(std::abs(difference));
  }
  void expect_agreement() const {
    const Estimate e = gap_.estimate();
    testing::Test::RecordProperty("z", std::to_string(e.mean / e.error));
    testing::Test::RecordProperty("error_per_slope", std::to_string(e.error / size_.mean()));
    // Student's t of 11 degrees of freedom beyond 4.4: 1 false alarm in 1000. 2 % for the curvature.
    EXPECT_LT(std::abs(e.mean), 4.4 * e.error + 0.02 * size_.mean())
        << e.mean << " +- " << e.error << ", slope is about " << size_.mean();
    // A missing derivative would be noticed.
    EXPECT_LT(e.error, 0.25 * size_.mean());
  }

 private:
  Tally gap_, size_;
};

}  // namespace selenite
