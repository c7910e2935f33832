// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/damped_step.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fit/solver/singular_directions.h"

namespace selenite {
namespace {

using Matrix = Eigen::MatrixXd;

/// What is known before any photo, as a term of the normal matrix: channels of an extinction are
/// about alike. It is in units of the noise of the sums, so that it gives way to what is seen.
/// Without it a channel that little light comes back from drifts, and takes its albedo along.
Matrix prior(const RecursiveLeastSquares& equations, const Unknowns& unknowns,
             const DampedStepOptions& options) {
  const Matrix& normal = equations.normal();
  Matrix prior = Matrix::Zero(normal.rows(), normal.cols());
  const auto& components = unknowns.components();
  for (Eigen::Index k = 0; k + 2 < prior.rows(); ++k) {
    const Component& first = components[static_cast<std::size_t>(k)];
    const bool colour = components[static_cast<std::size_t>(k) + 2].parameter == first.parameter;
    if (first.index != 0 || !colour || !unknowns.description_of(static_cast<int>(k)).alike)
      continue;
    const double seen = normal.diagonal()
                            .segment<3>(k)
                            .cwiseMax(options.least_strength * equations.strength().segment<3>(k))
                            .cwiseMax(0)
                            .sum();
    if (!(seen > 0)) continue;
    const double noise = equations.covariance().diagonal().segment<3>(k).sum() / seen;
    prior.block<3, 3>(k, k) = (Eigen::Matrix3d::Identity() - Eigen::Matrix3d::Constant(1.0 / 3)) *
                              (noise / (options.unlikeness * options.unlikeness));
  }
  return prior;
}

/// What the components that may move have to solve.
struct FreeProblem {
  const Matrix& normal;
  const Matrix& covariance;
  const Vector& residual;
  const Vector& scale;
};

/// Damped step in the singular directions of the scaled normal matrix, shorter where it is noise.
DampedStep free_step(const FreeProblem& problem, const std::vector<Eigen::Index>& free,
                     double damping, double least_value) {
  const Vector inverse = problem.scale(free).cwiseInverse();
  const Matrix scaled = inverse.asDiagonal() * problem.normal(free, free) * inverse.asDiagonal();
  const Matrix noise = inverse.asDiagonal() * problem.covariance(free, free) * inverse.asDiagonal();
  const SingularDirections directions(scaled);
  const Vector values = directions.values.cwiseMax(least_value);
  const Matrix spread = directions.out.transpose() * noise * directions.out;
  Vector along = directions.out.transpose() * inverse.cwiseProduct(problem.residual(free));
  const Vector whole = along.cwiseQuotient(values);
  for (Eigen::Index j = 0; j < along.size(); ++j) {
    const double square = along[j] * along[j];
    const double trust = square > 0 ? square / (square + spread(j, j)) : 0;
    along[j] *= trust / (values[j] + damping);
  }
  const Matrix back = directions.in * values.cwiseInverse().asDiagonal();
  const Vector deviation = (back * spread * back.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  DampedStep result{Vector::Zero(problem.scale.size()), Vector::Zero(problem.scale.size())};
  result.step(free) = inverse.cwiseProduct(directions.in * along);
  result.remaining(free) = inverse.cwiseProduct((directions.in * whole).cwiseAbs() + deviation);
  return result;
}

}  // namespace

DampedStep damped_step(const RecursiveLeastSquares& equations, const Unknowns& unknowns,
                       const Reparametrization& reparametrization, const Vector& u,
                       const StepLimits& limits, const DampedStepOptions& options) {
  const Matrix normal = equations.normal() + prior(equations, unknowns, options);
  const Vector residual = equations.right() - normal * u;
  const Vector scale = normal.diagonal()
                           .cwiseMax(options.least_strength * equations.strength())
                           .cwiseMax(0)
                           .cwiseSqrt();
  const auto is_roughness = [&](Eigen::Index k) {
    return unknowns.description_of(static_cast<int>(k)).scale == Scale::kRoughness;
  };
  std::vector<Eigen::Index> free;  // the others show in no picture, or are fixed
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (scale[k] > 0 && !(limits.fix_roughness && is_roughness(k))) free.push_back(k);
  DampedStep result{Vector::Zero(u.size()), Vector::Zero(u.size())};
  Vector& step = result.step;
  while (!free.empty()) {
    result = free_step({normal, equations.covariance(), residual, scale}, free, limits.damping,
                       options.least_value);
    const auto leaves = [&](Eigen::Index k) {
      return (u[k] <= reparametrization.minimum()[k] && step[k] < 0) ||
             (u[k] >= reparametrization.maximum()[k] && step[k] > 0);
    };
    if (std::erase_if(free, leaves) == 0) break;
    step.setZero();
    result.remaining.setZero();
  }
  const double reach = step.cwiseQuotient(reparametrization.cap()).cwiseAbs().maxCoeff();
  if (reach > limits.longest) step *= limits.longest / reach;
  step = (u + step).cwiseMax(reparametrization.minimum()).cwiseMin(reparametrization.maximum()) - u;
  return result;
}

}  // namespace selenite
