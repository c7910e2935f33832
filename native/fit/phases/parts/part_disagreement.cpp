// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/parts/part_disagreement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "fit/inference/expansion_point.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// By parts less one: the quantile at 0.95 of chi-square over its mean, and that of Student's t, which of
/// two parts counts as of three: half of all values that are not zero would be undetermined.
constexpr std::array kChiSquareRatio95{3.841, 2.996, 2.605};
constexpr std::array kStudent95{2.9200, 2.9200, 2.3534};

/// How far a part wants component k away from x, in `Reparametrization`; empty: it does not say.
std::optional<double> wanted(const Reparametrization& reparametrization, Eigen::Index k, double x,
                             const PartAnswer& part) {
  const Confidence& one = part.components[static_cast<std::size_t>(k)];
  double to = part.x[k];
  if (!one.determined) {
    to = std::clamp(x, one.interval[0], one.interval[1]);
    if (to == x) return std::nullopt;
  }
  return reparametrization.from_value(k, to) - reparametrization.from_value(k, x);
}

/// Half of the interval that the parts give component k, in `Reparametrization`; 0: nothing beyond chance.
double half_width(const Reparametrization& reparametrization, Eigen::Index k, double x,
                  double variance, const std::vector<PartAnswer>& parts) {
  double squares = 0;
  std::size_t count = 0;
  for (const PartAnswer& part : parts) {
    const std::optional<double> way = wanted(reparametrization, k, x, part);
    if (!way) continue;
    squares += square(*way);
    ++count;
  }
  if (count < 2) return 0;
  const std::size_t row = std::min(count - 2, kStudent95.size() - 1);
  const auto n = static_cast<double>(count);
  const double found = squares / (n * (n - 1));
  return found > kChiSquareRatio95[row] * variance ? kStudent95[row] * std::sqrt(found) : 0;
}

}  // namespace

void widen_by_parts(const Unknowns& unknowns, const Reparametrization& reparametrization,
                    const Vector& x, const std::vector<PartAnswer>& parts, TrustReport& report) {
  const Vector u = reparametrization.from_values(x);
  const ExpansionPoint point{unknowns, reparametrization, u, kConfidence};
  Vector factors = Vector::Ones(x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Confidence& one = report.components[static_cast<std::size_t>(k)];
    if (!one.determined) continue;
    const double variance = report.covariance(k, k);
    const double half = half_width(reparametrization, k, x[k], variance, parts);
    if (half == 0) continue;
    const std::array<double, 2> wide = point.values_between(k, -half, half);
    const double before = one.interval[1] - one.interval[0];
    one.interval = {std::min(one.interval[0], wide[0]), std::max(one.interval[1], wide[1])};
    if (before > 0) {
      const double wider = std::max(1.0, (one.interval[1] - one.interval[0]) / before);
      one.standard_error *= wider;
      one.lasting = 1 - (1 - one.lasting) / square(wider);
    }
    const double error = half / kQuantile90;
    if (variance > 0) factors[k] = std::max(1.0, error / std::sqrt(variance));
    // Beyond an even spread over the range it says nothing; below, how little is known.
    if (error >= point.options.prior * point.range(k)) one.determined = false;
  }
  report.covariance = factors.asDiagonal() * report.covariance * factors.asDiagonal();
}

}  // namespace selenite
