// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

// Judging random numbers. Every test that uses these has fixed seeds, so it never flickers; the
// false-alarm rates say how surprising a failure would be after the sampling has been changed.
namespace selenite {

/// A mean and its standard error.
struct Estimate {
  double mean = 0, error = 0;
  /// Distance to the truth in standard errors. |z| > 4 happens by chance once in 16 000.
  double z(double truth) const { return (mean - truth) / error; }
  double z(const Estimate& other) const {
    return (mean - other.mean) / std::hypot(error, other.error);
  }
};

/// Running mean and variance of independent numbers.
class Tally {
 public:
  void add(double x) {
    ++count_;
    sum_ += x;
    squares_ += x * x;
  }
  double mean() const { return sum_ / count_; }
  double variance() const { return (squares_ - sum_ * sum_ / count_) / (count_ - 1); }
  Estimate estimate() const { return {mean(), std::sqrt(std::max(variance(), 0.0) / count_)}; }
  long count() const { return count_; }

 private:
  long count_ = 0;
  double sum_ = 0, squares_ = 0;
};

/// Chi-square statistic of counts against expected counts as a standard normal number
/// (Wilson and Hilferty 1931); cells that expect fewer than five are pooled. Above 4: 1 in 32 000.
inline double chi_square_z(std::span<const double> counts, std::span<const double> expected) {
  double sum = 0, pooled_count = 0, pooled_expected = 0;
  int cells = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (expected[i] < 5) {
      pooled_count += counts[i];
      pooled_expected += expected[i];
      continue;
    }
    sum += (counts[i] - expected[i]) * (counts[i] - expected[i]) / expected[i];
    ++cells;
  }
  if (pooled_expected >= 5) {
    sum += (pooled_count - pooled_expected) * (pooled_count - pooled_expected) / pooled_expected;
    ++cells;
  }
  const double freedom = cells - 1, spread = 2 / (9 * freedom);
  return (std::cbrt(sum / freedom) - (1 - spread)) / std::sqrt(spread);
}

/// Correlation coefficient times sqrt(n): a standard normal number for independent columns.
inline double correlation_z(std::span<const double> a, std::span<const double> b) {
  const auto n = static_cast<double>(a.size());
  double ma = 0, mb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ma += a[i] / n;
    mb += b[i] / n;
  }
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
    ab += (a[i] - ma) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb) * std::sqrt(n);
}

}  // namespace selenite
