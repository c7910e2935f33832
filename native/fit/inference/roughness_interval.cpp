// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/roughness_interval.h"

#include <algorithm>
#include <cmath>

namespace selenite {
namespace {

/// Roughness k where pictures are as far from those at `coordinate` as a step by the slope says. The
/// distance is measured in log(x^4 + shift^4) / 4, which is the scale of the steps where x is high.
double by_fourth_power(const ExpansionPoint& point, Eigen::Index k, double coordinate,
                       double step) {
  const Reparametrization& reparametrization = point.reparametrization;
  const double floor = std::pow(point.options.roughness_shift, 4);
  const auto straight = [&](double x) { return std::log(std::pow(x, 4) + floor) / 4; };
  const double length = point.options.roughness_difference;
  const double here = straight(reparametrization.to_value(k, coordinate));
  const double far = straight(reparametrization.to_value(k, coordinate + length));
  const double slope = (far - here) / length;
  return std::pow(std::max(std::exp(4 * (here + step * slope)) - floor, 0.0), 0.25);
}

/// Next to 0 many roughnesses lie within one standard deviation, as pictures hardly change there. Of
/// values that are alike beforehand, their mean by likelihood has the least error. A smooth body then
/// does not end at the roughest of the values that look the same. Never farther than the step.
double mean_roughness_step(const ExpansionPoint& point, Eigen::Index k, double step, double error) {
  const int points = point.options.likelihood_points;
  const double reach = point.options.likelihood_reach;
  const auto [low, high] = point.values_between(k, step - reach * error, step + reach * error);
  const double width = (high - low) / points;
  double sum = 0, weighted = 0;
  for (int i = 0; i < points; ++i) {
    const double x = low + (i + 0.5) * width;
    const double off = (point.reparametrization.from_value(k, x) - point.u[k] - step) / error;
    const double likelihood = std::exp(-off * off / 2);
    sum += likelihood;
    weighted += likelihood * x;
  }
  return std::min(step, point.reparametrization.from_value(k, weighted / sum) - point.u[k]);
}

}  // namespace

void extend_roughness_interval(const ExpansionPoint& point, Eigen::Index k, double coordinate,
                               double reach, std::array<double, 2>& interval) {
  interval[0] = std::max(std::min(interval[0], by_fourth_power(point, k, coordinate, -reach)),
                         point.unknowns.minimum()[k]);
  interval[1] = std::min(std::max(interval[1], by_fourth_power(point, k, coordinate, reach)),
                         point.unknowns.maximum()[k]);
}

double roughness_step(const ExpansionPoint& point, Eigen::Index k, double step) {
  if (step >= 0) return step;
  const double end = by_fourth_power(point, k, point.u[k], step);
  return std::min(step, point.reparametrization.from_value(k, end) - point.u[k]);
}

double bisected_step(const ConfidenceOptions& options, double previous_step, double step) {
  const double noise = options.no_direction * options.roughness_difference;
  const bool between = previous_step * step < 0 && std::abs(previous_step) > noise;
  return between ? step * previous_step / (previous_step - step) : step;
}

Vector likely_step(const ExpansionPoint& point, const std::vector<Eigen::Index>& free,
                   const NormalSolution& solution) {
  Vector likely = solution.step;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const Eigen::Index k = free[i];
    const double variance = solution.covariance(at, at), error = std::sqrt(variance);
    const double to = point.u[k] + solution.step[at];
    const bool known = error > 0 && error < point.options.undetermined * point.range(k);
    if (!point.is_roughness(k) || !known) continue;
    if (to <= point.reparametrization.minimum()[k] || to >= point.reparametrization.maximum()[k])
      continue;
    const double less = mean_roughness_step(point, k, solution.step[at], error) - solution.step[at];
    likely += solution.covariance.col(at) * (less / variance);
  }
  return likely;
}

}  // namespace selenite
