// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/inference/normal_solution.h"

#include <algorithm>
#include <cmath>

#include "fit/solver/singular_directions.h"

namespace selenite {
namespace {

using Matrix = Eigen::MatrixXd;

/// What the free components do for the fixed ones.
void respond(const NormalEquations& equations, const std::vector<Eigen::Index>& free,
             const std::vector<FixedComponent>& fixed, double coupled, NormalSolution& solution) {
  const Eigen::Index n = solution.step.size();
  solution.responses.resize(n, static_cast<Eigen::Index>(fixed.size()));
  for (std::size_t h = 0; h < fixed.size(); ++h) {
    const auto& [m, step, extent] = fixed[h];
    Vector coupling = equations.normal.col(m)(free);
    for (Eigen::Index k = 0; k < n; ++k) {
      const double error =
          std::sqrt(equations.normal_variance(free[static_cast<std::size_t>(k)], m));
      if (std::abs(coupling[k]) <= coupled * error) coupling[k] = 0;
    }
    const Vector response = solution.inverse * coupling;
    solution.step -= step * response;
    solution.responses.col(static_cast<Eigen::Index>(h)) = extent * response;
  }
  solution.covariance += solution.responses * solution.responses.transpose();
}

}  // namespace

NormalSolution solve(const NormalEquations& equations, const ExpansionPoint& point,
                     const std::vector<Eigen::Index>& free,
                     const std::vector<FixedComponent>& fixed, const Vector& unsure_step) {
  const ConfidenceOptions& options = point.options;
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
  NormalSolution solution;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double error = std::sqrt(out.col(j).cwiseAbs2().dot(doubt * in.col(j).cwiseAbs2()));
    if (!(directions.values[j] > options.resolved * error)) continue;
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
      const double range = point.range(free[static_cast<std::size_t>(k)]);
      steepest = std::max(steepest, std::abs(inverse[k] * in(k, j)) / (options.prior * range));
    }
    spread(j, j) = 1 / (steepest * steepest);
  }
  solution.step = inverse.cwiseProduct(in * reciprocal.cwiseProduct(along));
  solution.inverse = inverse.asDiagonal() * (in * reciprocal.asDiagonal() * out.transpose()) *
                     inverse.asDiagonal();
  solution.covariance =
      inverse.asDiagonal() * (in * spread * in.transpose()) * inverse.asDiagonal();
  const Vector pixels =
      (solution.inverse * equations.score_covariance(free, free) * solution.inverse.transpose())
          .diagonal();
  const Vector widening =
      equations.clusters.widening(free, solution.inverse, solution.step, pixels);
  const Vector noise_alone = solution.covariance.diagonal();
  solution.covariance = widening.asDiagonal() * solution.covariance * widening.asDiagonal();
  const Vector differing = solution.covariance.diagonal() - noise_alone;
  respond(equations, free, fixed, options.coupled, solution);
  if (unsure_step.size() > 0)
    solution.covariance += unsure_step(free) * unsure_step(free).transpose();
  solution.lasting = differing.cwiseQuotient(solution.covariance.diagonal());
  return solution;
}

int strongest_partner(const NormalSolution& solution, Eigen::Index at,
                      const std::vector<Eigen::Index>& free,
                      const std::vector<FixedComponent>& fixed, double least_correlation) {
  const Matrix& covariance = solution.covariance;
  const double own = std::sqrt(covariance(at, at));
  int partner = -1;
  double strongest = least_correlation;
  const auto consider = [&](double correlation, Eigen::Index k) {
    if (!(std::abs(correlation) > strongest)) return;
    strongest = std::abs(correlation);
    partner = static_cast<int>(k);
  };
  // Fixed components come first: those that make up for one are correlated with each other, too.
  for (std::size_t h = 0; h < fixed.size(); ++h)
    consider(solution.responses(at, static_cast<Eigen::Index>(h)) / own, fixed[h].k);
  if (partner >= 0) return partner;
  for (Eigen::Index j = 0; j < covariance.rows(); ++j)
    if (j != at)
      consider(covariance(at, j) / (own * std::sqrt(covariance(j, j))),
               free[static_cast<std::size_t>(j)]);
  return partner;
}

}  // namespace selenite
