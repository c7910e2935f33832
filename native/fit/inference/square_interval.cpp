// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/square_interval.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// Where a value leads whose square goes a step by the slope at x.
double by_square(double x, double step) { return std::sqrt(std::max(x * x + 2 * x * step, 0.0)); }

}  // namespace

bool shows_by_square(const ExpansionPoint& point, const NormalEquations& equations,
                     const NormalSolution& solution, Eigen::Index at, Eigen::Index k) {
  const double inverse = solution.inverse(at, at);
  return point.unknowns.description_of(static_cast<int>(k)).squared && inverse > 0 &&
         1 < point.options.square_share * equations.normal(k, k) * inverse;
}

void bend_step(const ExpansionPoint& point, double x, Eigen::Index at, Eigen::Index k,
               NormalSolution& solution) {
  const double to = std::clamp(by_square(x, solution.step[at]), point.unknowns.minimum()[k],
                               point.unknowns.maximum()[k]);
  const double more = to - x - solution.step[at];
  solution.step += solution.inverse.col(at) * (more / solution.inverse(at, at));
}

void set_square_interval(const ExpansionPoint& point, Eigen::Index k, double x, double step,
                         double error, bool far, Confidence& one) {
  const double minimum = point.unknowns.minimum()[k], maximum = point.unknowns.maximum()[k];
  const auto end = [&](double to) { return std::clamp(to, minimum, maximum); };
  const double low = step - kQuantile90 * error, high = step + kQuantile90 * error;
  one.interval = {end(by_square(x, low)), end(by_square(x, high))};
  if (far)
    one.interval = {std::min(one.interval[0], end(x + low)),
                    std::max(one.interval[1], end(x + high))};
  one.standard_error = (one.interval[1] - one.interval[0]) / (2 * kQuantile90);
  one.determined = one.standard_error < point.options.undetermined * (maximum - minimum);
}

}  // namespace selenite
