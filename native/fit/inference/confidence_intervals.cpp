// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/confidence_intervals.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fit/solver/singular_directions.h"
#include "fit/evaluate/finite_differences.h"

namespace selenite {
namespace {

using Matrix = Eigen::MatrixXd;

/// How far a coordinate may go: at most a factor of ten either way for what spans decades.
double range_of(const Reparametrization& reparametrization, Eigen::Index k) {
  return std::min(reparametrization.maximum()[k] - reparametrization.minimum()[k], kConfidence.decades);
}

/// A component that is not solved for: where it goes, and how far from there it may lie (a standard
/// deviation), in its coordinate.
struct Fixed {
  Eigen::Index k;
  double way, extent;
};

/// The step along directions that are resolved, with its covariance.
struct Solution {
  Vector step;
  Matrix covariance;
  Matrix inverse;  ///< of the normal matrix
  Matrix answers;  ///< what each fixed component's extent makes of the others: a column each
  double surprise = 0;
};

/// Solves for the components `free` alone, in the directions of the scaled normal matrix. Those
/// whose value is noise do not move and are as wide as the clamps leave them. The components `fixed`
/// go elsewhere, or may lie there, and the others make up for it where the two are seen to be coupled.
Solution solve(const NormalEquations& equations, const Reparametrization& reparametrization,
               const std::vector<Eigen::Index>& free, const std::vector<Fixed>& fixed,
               const Vector& unsure_step) {
  const Vector inverse = equations.normal.diagonal()(free).cwiseSqrt().cwiseInverse();
  const auto scaled = [&](const Matrix& m) -> Matrix {
    return inverse.asDiagonal() * m(free, free) * inverse.asDiagonal();
  };
  const Matrix doubt = inverse.cwiseAbs2().asDiagonal() * equations.normal_variance(free, free) *
                       inverse.cwiseAbs2().asDiagonal();
  const SingularDirections directions(scaled(equations.normal));
  const Matrix &in = directions.in, &out = directions.out;
  const Vector along = out.transpose() * inverse.cwiseProduct(-equations.gradient(free));
  const Matrix noise = out.transpose() * scaled(equations.score_covariance) * out;
  const Eigen::Index n = along.size();
  Vector reciprocal = Vector::Zero(n);  // of the values; 0: not resolved
  Solution solution;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double error = std::sqrt(out.col(j).cwiseAbs2().dot(doubt * in.col(j).cwiseAbs2()));
    if (!(directions.values[j] > kConfidence.resolved * error)) continue;
    reciprocal[j] = 1 / directions.values[j];
    const double deviation = std::sqrt(noise(j, j));
    if (std::abs(along[j]) > solution.surprise * deviation)
      solution.surprise = std::abs(along[j]) / deviation;
  }
  Matrix spread = reciprocal.asDiagonal() * noise * reciprocal.asDiagonal();
  for (Eigen::Index j = 0; j < n; ++j) {
    if (reciprocal[j] > 0) continue;
    double steepest = 0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double range = range_of(reparametrization, free[static_cast<std::size_t>(k)]);
      steepest = std::max(steepest, std::abs(inverse[k] * in(k, j)) / (kConfidence.prior * range));
    }
    spread(j, j) = 1 / (steepest * steepest);
  }
  solution.step = inverse.cwiseProduct(in * reciprocal.cwiseProduct(along));
  solution.inverse = inverse.asDiagonal() * (in * reciprocal.asDiagonal() * out.transpose()) *
                     inverse.asDiagonal();
  solution.covariance =
      inverse.asDiagonal() * (in * spread * in.transpose()) * inverse.asDiagonal();
  solution.answers.resize(n, static_cast<Eigen::Index>(fixed.size()));
  for (std::size_t h = 0; h < fixed.size(); ++h) {
    const auto& [m, way, extent] = fixed[h];
    Vector coupling = equations.normal.col(m)(free);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double error =
          std::sqrt(equations.normal_variance(free[static_cast<std::size_t>(k)], m));
      if (std::abs(coupling[k]) <= kConfidence.coupled * error) coupling[k] = 0;
    }
    const Vector answer = solution.inverse * coupling;
    solution.step -= way * answer;
    solution.answers.col(static_cast<Eigen::Index>(h)) = extent * answer;
  }
  solution.covariance += solution.answers * solution.answers.transpose();
  if (unsure_step.size() > 0) solution.covariance += unsure_step(free) * unsure_step(free).transpose();
  return solution;
}

/// Values of component k between two offsets from u in its coordinate, inside the bounds.
std::array<double, 2> values_between(const Reparametrization& reparametrization, const Vector& u,
                                     Eigen::Index k, double low, double high) {
  const auto value = [&](double offset) {
    Vector end = u;
    end[k] = std::clamp(u[k] + offset, reparametrization.minimum()[k], reparametrization.maximum()[k]);
    return reparametrization.to_values(end)[k];
  };
  return {value(low), value(high)};
}

bool is_roughness(const Unknowns& unknowns, Eigen::Index k) {
  return unknowns.description_of(static_cast<int>(k)).scale == Scale::kRoughness;
}

/// Roughness k where pictures are as far from those at u as a step `way` of its coordinate says. The
/// slope by a low roughness is a difference with a picture above it (`render_derivatives`): below there
/// is no room. Down to the bound pictures change by far less than it says: with the fourth power of
/// roughness (3.6, measured from 0.01 to 0.07 and 0.23 on the thesis' bunny). So the way is previous_step in
/// log(x^4 + s^4) / 4, which is the coordinate of the steps again where x is high.
double by_fourth_power(const Reparametrization& reparametrization, const Vector& u, Eigen::Index k, double way) {
  constexpr double kShift = 0.2;
  const double floor = std::pow(kShift, 4);
  const auto straight = [&](double x) { return std::log(std::pow(x, 4) + floor) / 4; };
  Vector far = u;
  far[k] += FiniteDifferenceOptions{}.roughness;
  const double here = straight(reparametrization.to_values(u)[k]);
  const double slope = (straight(reparametrization.to_values(far)[k]) - here) / FiniteDifferenceOptions{}.roughness;
  return std::pow(std::max(std::exp(4 * (here + way * slope)) - floor, 0.0), 0.25);
}

/// The interval of a roughness reaches as far as nothing can be seen of it.
void extend_roughness_interval(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& u,
                     Eigen::Index k, double reach, Confidence& one) {
  if (!is_roughness(unknowns, k)) return;
  one.interval[0] = std::max(std::min(one.interval[0], by_fourth_power(reparametrization, u, k, -reach)),
                             unknowns.minimum()[k]);
  one.interval[1] = std::min(std::max(one.interval[1], by_fourth_power(reparametrization, u, k, reach)),
                             unknowns.maximum()[k]);
}

/// The coordinate of component k where its value is `value` and all others are as at u.
double coordinate_of(const Reparametrization& reparametrization, const Vector& u, Eigen::Index k,
                     double value) {
  Vector x = reparametrization.to_values(u);
  x[k] = value;
  return reparametrization.from_values(x)[k];
}

/// A step down to a low roughness falls short in its coordinate (see `by_fourth_power`). So does one up,
/// and stays so: noise alone would take a smooth body to a roughness that looks the same.
double roughness_step(const Reparametrization& reparametrization, const Vector& u, Eigen::Index k, double step) {
  if (step >= 0) return step;
  const double end = by_fourth_power(reparametrization, u, k, step);
  return std::min(step, coordinate_of(reparametrization, u, k, end) - u[k]);
}

/// Next to 0 many roughnesses lie within one standard deviation, as pictures hardly change there. Of
/// values that are alike beforehand, their mean by likelihood has the least error: a smooth body is not
/// taken to the farthest of where it might just as well be. Never farther than the step.
double mean_roughness_step(const Reparametrization& reparametrization, const Vector& u, Eigen::Index k, double step,
                   double error) {
  constexpr int kPoints = 200;
  constexpr double kReach = 4;  // standard deviations
  const auto [low, high] =
      values_between(reparametrization, u, k, step - kReach * error, step + kReach * error);
  const double width = (high - low) / kPoints;
  double sum = 0, weighted = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double x = low + (i + 0.5) * width;
    const double off = (coordinate_of(reparametrization, u, k, x) - u[k] - step) / error;
    const double likelihood = std::exp(-off * off / 2);
    sum += likelihood;
    weighted += likelihood * x;
  }
  return std::min(step, coordinate_of(reparametrization, u, k, weighted / sum) - u[k]);
}

/// The step with each roughness at that mean if it is known and inside its bounds; the others follow.
Vector likely_step(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& u,
                   const std::vector<Eigen::Index>& free, const Solution& solution) {
  Vector likely = solution.step;
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const Eigen::Index k = free[i];
    const double variance = solution.covariance(at, at), error = std::sqrt(variance);
    const double to = u[k] + solution.step[at];
    if (!is_roughness(unknowns, k) || !(error > 0) || error >= kConfidence.undetermined * range_of(reparametrization, k))
      continue;
    if (to <= reparametrization.minimum()[k] || to >= reparametrization.maximum()[k]) continue;
    const double less =
        mean_roughness_step(reparametrization, u, k, solution.step[at], error) - solution.step[at];
    likely += solution.covariance.col(at) * (less / variance);
  }
  return likely;
}

/// Whether others make up for component k, the `at`-th, but for what goes with its square.
bool is_squared(const Unknowns& unknowns, const NormalEquations& equations, const Solution& solution,
                Eigen::Index at, Eigen::Index k) {
  constexpr double kMadeUpFor = 0.1;  // share of its normal matrix that is left, at most
  const double inverse = solution.inverse(at, at);
  return unknowns.description_of(static_cast<int>(k)).squared && inverse > 0 &&
         1 < kMadeUpFor * equations.normal(k, k) * inverse;
}

/// Where a value leads whose square goes a step by the slope at x.
double by_square(double x, double step) {
  return std::sqrt(std::max(x * x + 2 * x * step, 0.0));
}

/// The others follow, as they make up for it.
void bend_step(const Unknowns& unknowns, double x, Eigen::Index at, Eigen::Index k,
               Solution& solution) {
  const double to =
      std::clamp(by_square(x, solution.step[at]), unknowns.minimum()[k], unknowns.maximum()[k]);
  const double more = to - x - solution.step[at];
  solution.step += solution.inverse.col(at) * (more / solution.inverse(at, at));
}

/// Where both ends of a way that was previous_step lead into it, the answer lies in between, divided as the two
/// steps are: neither knows how far its slope goes, and they would go to and fro.
double bisected_step(double previous_step, double step) {
  constexpr double kNoise = 0.1 * FiniteDifferenceOptions{}.roughness;
  const bool between = previous_step * step < 0 && std::abs(previous_step) > kNoise;
  return between ? step * previous_step / (previous_step - step) : step;
}

/// What the solution says about component k, the `at`-th of those solved for.
Confidence confidence(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& u,
                      const Solution& solution, Eigen::Index at, Eigen::Index k) {
  Confidence one;
  const double error = std::sqrt(solution.covariance(at, at)), step = solution.step[at];
  const double to = u[k] + step;
  one.interval =
      values_between(reparametrization, u, k, step - kConfidence.quantile_90 * error, step + kConfidence.quantile_90 * error);
  Vector end = u;
  end[k] = std::clamp(to, reparametrization.minimum()[k], reparametrization.maximum()[k]);
  extend_roughness_interval(unknowns, reparametrization, end, k, kConfidence.quantile_90 * error, one);
  one.standard_error = one.by_slope = error * reparametrization.slope(reparametrization.to_values(end))[k];
  one.determined = error < kConfidence.undetermined * range_of(reparametrization, k);
  if (to <= reparametrization.minimum()[k]) one.at_bound = AtBound::kMinimum;
  if (to >= reparametrization.maximum()[k]) one.at_bound = AtBound::kMaximum;
  return one;
}

/// The same for one that goes with its square, from x. `far`: the step may lead to where it does not,
/// as what is left of the value itself is of the same size there: between that end and the straight one.
void square_interval(const Unknowns& unknowns, double x, double step, double error, bool far,
                       Eigen::Index k, Confidence& one) {
  const auto end = [&](double to) {
    return std::clamp(to, unknowns.minimum()[k], unknowns.maximum()[k]);
  };
  const double low = step - kConfidence.quantile_90 * error, high = step + kConfidence.quantile_90 * error;
  one.interval = {end(by_square(x, low)), end(by_square(x, high))};
  if (far)
    one.interval = {std::min(one.interval[0], end(x + low)),
                    std::max(one.interval[1], end(x + high))};
  one.standard_error = (one.interval[1] - one.interval[0]) / (2 * kConfidence.quantile_90);
  one.determined =
      one.standard_error < kConfidence.undetermined * (unknowns.maximum()[k] - unknowns.minimum()[k]);
}

/// The component whose error goes most with that of the `at`-th, if that is much.
int strongest_partner(const Solution& solution, Eigen::Index at,
                      const std::vector<Eigen::Index>& free, const std::vector<Fixed>& fixed) {
  const Matrix& covariance = solution.covariance;
  const double own = std::sqrt(covariance(at, at));
  int partner = -1;
  double strongest = kConfidence.correlated;
  const auto consider = [&](double correlation, Eigen::Index k) {
    if (!(std::abs(correlation) > strongest)) return;
    strongest = std::abs(correlation);
    partner = static_cast<int>(k);
  };
  // First those fixed: the others, which make up for them, go with each other too.
  for (std::size_t h = 0; h < fixed.size(); ++h)
    consider(solution.answers(at, static_cast<Eigen::Index>(h)) / own, fixed[h].k);
  if (partner >= 0) return partner;
  for (Eigen::Index j = 0; j < covariance.rows(); ++j)
    if (j != at)
      consider(covariance(at, j) / (own * std::sqrt(covariance(j, j))),
           free[static_cast<std::size_t>(j)]);
  return partner;
}

/// How far a component may lie from `value`, where it is fixed.
double extent_of(const Reparametrization& reparametrization, const Vector& u, Eigen::Index k, double value,
                 const std::array<double, 2>& interval) {
  const double here = coordinate_of(reparametrization, u, k, value);
  return std::max(coordinate_of(reparametrization, u, k, interval[1]) - here,
                  here - coordinate_of(reparametrization, u, k, interval[0])) /
         kConfidence.quantile_90;
}

}  // namespace

Estimate estimate(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& u,
                  const NormalEquations& equations, const OtherPasses& others) {
  const Eigen::Index n = u.size();
  Estimate result;
  result.step = Vector::Zero(n);
  result.components.resize(static_cast<std::size_t>(n));
  std::vector<Eigen::Index> free;
  std::vector<Fixed> fixed;
  for (Eigen::Index k = 0; k < n; ++k) {
    Confidence& one = result.components[static_cast<std::size_t>(k)];
    if (const auto i = static_cast<std::size_t>(k); !others.known.empty() && others.known[i]) {
      const auto& [value, sure] = *others.known[i];
      one = sure;
      result.step[k] = coordinate_of(reparametrization, u, k, value) - u[k];
      fixed.push_back({k, result.step[k], extent_of(reparametrization, u, k, value, sure.interval)});
      continue;
    }
    one.standard_error = one.by_slope = std::numeric_limits<double>::infinity();
    one.interval = {unknowns.minimum()[k], unknowns.maximum()[k]};
    if (equations.normal(k, k) > kConfidence.resolved * std::sqrt(equations.normal_variance(k, k)))
      free.push_back(k);
    else
      fixed.push_back({k, 0, kConfidence.prior * range_of(reparametrization, k)});
  }
  const auto confirmed = [&](Eigen::Index k) {
    return !others.squared.empty() && others.squared[static_cast<std::size_t>(k)];
  };
  const auto goes_by_square = [&](const Solution& solution, Eigen::Index at, Eigen::Index k) {
    const double sure = kConfidence.undetermined * range_of(reparametrization, k);
    return (confirmed(k) && solution.covariance(at, at) < square(sure)) ||
           is_squared(unknowns, equations, solution, at, k);
  };
  // Those that would leave at a bound stay there, and the others are solved for without them.
  for (bool again = true; again && !free.empty();) {
    Solution solution = solve(equations, reparametrization, free, fixed, others.unsure_step);
    const Vector straight = solution.step;
    for (std::size_t i = 0; i < free.size(); ++i)
      if (const auto at = static_cast<Eigen::Index>(i); goes_by_square(solution, at, free[i]))
        bend_step(unknowns, u[free[i]], at, free[i], solution);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (double& step = solution.step[static_cast<Eigen::Index>(i)]; is_roughness(unknowns, free[i])) {
        step = roughness_step(reparametrization, u, free[i], step);
        if (others.previous_step.size() > 0) step = bisected_step(others.previous_step[free[i]], step);
      }
    result.surprise = solution.surprise;
    const Vector likely = likely_step(unknowns, reparametrization, u, free, solution);
    solution.covariance *= square(others.beyond_noise);
    std::vector<Eigen::Index> kept;
    std::vector<Fixed> bounded;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(i);
      const Eigen::Index k = free[i];
      Confidence& one = result.components[static_cast<std::size_t>(k)];
      one = confidence(unknowns, reparametrization, u, solution, at, k);
      if (goes_by_square(solution, at, k))
        square_interval(unknowns, u[k], straight[at], std::sqrt(solution.covariance(at, at)),
                          confirmed(k), k, one);
      one.correlated_with = strongest_partner(solution, at, free, fixed);
      result.step[k] = likely[at];
      if (one.at_bound == AtBound::kNo) {
        kept.push_back(k);
        continue;
      }
      const bool low = one.at_bound == AtBound::kMinimum;
      result.step[k] = (low ? reparametrization.minimum() : reparametrization.maximum())[k] - u[k];
      // It is at the bound for the answer, so the interval reaches there whatever the step says.
      const double bound = (low ? unknowns.minimum() : unknowns.maximum())[k];
      one.interval[low ? 0 : 1] = bound;
      bounded.push_back({k, 0, extent_of(reparametrization, u, k, bound, one.interval)});
    }
    fixed.insert(fixed.end(), bounded.begin(), bounded.end());
    again = kept.size() < free.size();
    free = std::move(kept);
  }
  return result;
}

void contain(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& x,
          std::vector<Confidence>& components) {
  const Vector u = reparametrization.from_values(x);
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Confidence& one = components[static_cast<std::size_t>(k)];
    auto& [low, high] = one.interval;
    if (low <= x[k] && x[k] <= high) continue;
    low = std::min(low, x[k]);
    high = std::max(high, x[k]);
    const double error =
        (coordinate_of(reparametrization, u, k, high) - coordinate_of(reparametrization, u, k, low)) /
        (2 * kConfidence.quantile_90);
    one.standard_error = std::max(one.standard_error, (high - low) / (2 * kConfidence.quantile_90));
    if (error >= kConfidence.undetermined * range_of(reparametrization, k)) one.determined = false;
    if (unknowns.minimum()[k] < x[k] && x[k] < unknowns.maximum()[k]) one.at_bound = AtBound::kNo;
  }
}

}  // namespace selenite
