// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/confidence_intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/inference/normal_solution.h"
#include "fit/inference/roughness_interval.h"
#include "fit/inference/square_interval.h"
#include "math/scalar.h"

namespace selenite {
namespace {

/// Of a normal distribution with this interval.
double error_of(const std::array<double, 2>& interval) {
  return (interval[1] - interval[0]) / (2 * kQuantile90);
}

/// What the solution says about component k, the `at`-th free one.
Confidence confidence(const ExpansionPoint& point, const NormalSolution& solution, Eigen::Index at,
                      Eigen::Index k) {
  const Reparametrization& reparametrization = point.reparametrization;
  Confidence one;
  const double error = std::sqrt(solution.covariance(at, at)), step = solution.step[at];
  const double to = point.u[k] + step, end = point.clamped(k, to);
  one.interval = point.values_between(k, step - kQuantile90 * error, step + kQuantile90 * error);
  if (point.is_roughness(k))
    extend_roughness_interval(point, k, end, kQuantile90 * error, one.interval);
  one.by_slope = error * reparametrization.slope(k, reparametrization.to_value(k, end));
  // Next to 0 the slope of a roughness says far more than the interval allows.
  one.standard_error =
      point.is_roughness(k) ? std::min(one.by_slope, error_of(one.interval)) : one.by_slope;
  one.determined = error < point.options.undetermined * point.range(k);
  one.lasting = solution.lasting[at];
  if (to <= reparametrization.minimum()[k]) one.at_bound = AtBound::kMinimum;
  if (to >= reparametrization.maximum()[k]) one.at_bound = AtBound::kMaximum;
  return one;
}

/// Standard deviation of a component around `value`, where it is fixed.
double extent_of(const ExpansionPoint& point, Eigen::Index k, double value,
                 const std::array<double, 2>& interval) {
  const auto coordinate = [&](double x) { return point.reparametrization.from_value(k, x); };
  const double here = coordinate(value);
  return std::max(coordinate(interval[1]) - here, here - coordinate(interval[0])) / kQuantile90;
}

/// Solves for the free components, fixes those that would leave at a bound, and solves again.
class Estimator {
 public:
  Estimator(const ExpansionPoint& point, const NormalEquations& equations,
            const OtherPasses& others)
      : point_(point), equations_(equations), others_(others) {
    const Eigen::Index n = point.u.size();
    result_.step = Vector::Zero(n);
    result_.components.resize(static_cast<std::size_t>(n));
    for (Eigen::Index k = 0; k < n; ++k) sort(k);
  }

  Estimate run() {
    result_.covariance = covariance_of_fixed();
    while (!free_.empty() && solve_once()) {
    }
    return std::move(result_);
  }

 private:
  /// Notes whether component k is free or fixed.
  void sort(Eigen::Index k) {
    Confidence& one = result_.components[static_cast<std::size_t>(k)];
    if (const auto i = static_cast<std::size_t>(k); !others_.known.empty() && others_.known[i]) {
      const auto& [value, sure] = *others_.known[i];
      one = sure;
      result_.step[k] = point_.reparametrization.from_value(k, value) - point_.u[k];
      fixed_.push_back({k, result_.step[k], extent_of(point_, k, value, sure.interval)});
      return;
    }
    one.standard_error = one.by_slope = std::numeric_limits<double>::infinity();
    one.interval = {point_.unknowns.minimum()[k], point_.unknowns.maximum()[k]};
    const double error = std::sqrt(equations_.normal_variance(k, k));
    if (equations_.normal(k, k) > point_.options.resolved * error)
      free_.push_back(k);
    else
      fixed_.push_back({k, 0, point_.options.prior * point_.range(k)});
  }

  /// Where no component is free.
  Eigen::MatrixXd covariance_of_fixed() const {
    const Eigen::Index n = point_.u.size();
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
    for (const FixedComponent& one : fixed_) covariance(one.k, one.k) = square(one.extent);
    return covariance;
  }

  /// Of all components: the free ones answer to where the fixed ones may lie.
  Eigen::MatrixXd covariance_by(const NormalSolution& solution) const {
    Eigen::MatrixXd covariance = covariance_of_fixed();
    covariance(free_, free_) = solution.covariance;
    for (std::size_t h = 0; h < fixed_.size(); ++h) {
      const Vector across =
          -fixed_[h].extent * solution.responses.col(static_cast<Eigen::Index>(h));
      covariance(free_, fixed_[h].k) = across;
      covariance(fixed_[h].k, free_) = across.transpose();
    }
    return covariance;
  }

  bool is_confirmed_square(Eigen::Index k) const {
    return !others_.squared.empty() && others_.squared[static_cast<std::size_t>(k)];
  }
  bool is_square(const NormalSolution& solution, Eigen::Index at, Eigen::Index k) const {
    const double sure = point_.options.undetermined * point_.range(k);
    return (is_confirmed_square(k) && solution.covariance(at, at) < square(sure)) ||
           shows_by_square(point_, equations_, solution, at, k);
  }

  /// Steps of squares and roughnesses, which are not linear.
  void correct_steps(NormalSolution& solution) const {
    for (std::size_t i = 0; i < free_.size(); ++i)
      if (const auto at = static_cast<Eigen::Index>(i); is_square(solution, at, free_[i]))
        bend_step(point_, point_.u[free_[i]], at, free_[i], solution);
    for (std::size_t i = 0; i < free_.size(); ++i) {
      if (!point_.is_roughness(free_[i])) continue;
      double& step = solution.step[static_cast<Eigen::Index>(i)];
      step = roughness_step(point_, free_[i], step);
      if (others_.previous_step.size() > 0)
        step = bisected_step(point_.options, others_.previous_step[free_[i]], step);
    }
  }

  /// It is at the bound for the answer, so the interval reaches there whatever the step says.
  FixedComponent fix_at_bound(Eigen::Index k, Confidence& one) {
    const bool low = one.at_bound == AtBound::kMinimum;
    const Reparametrization& reparametrization = point_.reparametrization;
    result_.step[k] =
        (low ? reparametrization.minimum() : reparametrization.maximum())[k] - point_.u[k];
    const double bound = (low ? point_.unknowns.minimum() : point_.unknowns.maximum())[k];
    one.interval[low ? 0 : 1] = bound;
    return {k, 0, extent_of(point_, k, bound, one.interval)};
  }

  /// Whether components were fixed at bounds.
  bool solve_once() {
    NormalSolution solution = solve(equations_, point_, free_, fixed_, others_.unsure_step);
    const Vector straight = solution.step;
    correct_steps(solution);
    result_.surprise = solution.surprise;
    const Vector likely = likely_step(point_, free_, solution);
    solution.covariance *= square(others_.beyond_noise);
    result_.covariance = covariance_by(solution);
    std::vector<Eigen::Index> kept;
    std::vector<FixedComponent> bounded;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const Eigen::Index k = free_[i];
      Confidence& one = result_.components[static_cast<std::size_t>(k)];
      one = confidence(point_, solution, at, k);
      if (is_square(solution, at, k))
        set_square_interval(point_, k, point_.u[k], straight[at],
                            std::sqrt(solution.covariance(at, at)), is_confirmed_square(k), one);
      one.correlated_with =
          strongest_partner(solution, at, free_, fixed_, point_.options.correlated);
      result_.step[k] = likely[at];
      if (one.at_bound == AtBound::kNo)
        kept.push_back(k);
      else
        bounded.push_back(fix_at_bound(k, one));
    }
    fixed_.insert(fixed_.end(), bounded.begin(), bounded.end());
    const bool again = kept.size() < free_.size();
    free_ = std::move(kept);
    if (free_.empty()) result_.covariance = covariance_of_fixed();
    return again;
  }

  const ExpansionPoint& point_;
  const NormalEquations& equations_;
  const OtherPasses& others_;
  std::vector<Eigen::Index> free_;
  std::vector<FixedComponent> fixed_;
  Estimate result_;
};

}  // namespace

Estimate estimate(const Unknowns& unknowns, const Reparametrization& reparametrization,
                  const Vector& u, const NormalEquations& equations, const OtherPasses& others,
                  const ConfidenceOptions& options) {
  const ExpansionPoint point{unknowns, reparametrization, u, options};
  return Estimator(point, equations, others).run();
}

void contain(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& x,
             std::vector<Confidence>& components, const ConfidenceOptions& options) {
  const Vector u = reparametrization.from_values(x);
  const ExpansionPoint point{unknowns, reparametrization, u, options};
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Confidence& one = components[static_cast<std::size_t>(k)];
    auto& [low, high] = one.interval;
    if (low <= x[k] && x[k] <= high) continue;
    low = std::min(low, x[k]);
    high = std::max(high, x[k]);
    const double error =
        (reparametrization.from_value(k, high) - reparametrization.from_value(k, low)) /
        (2 * kQuantile90);
    one.standard_error = std::max(one.standard_error, error_of(one.interval));
    if (error >= options.undetermined * point.range(k)) one.determined = false;
    if (unknowns.minimum()[k] < x[k] && x[k] < unknowns.maximum()[k]) one.at_bound = AtBound::kNo;
  }
}

}  // namespace selenite
