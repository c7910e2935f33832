// SPDX-License-Identifier: GPL-3.0-or-later
// Where a solution of the normal equations leads, and how far a step may go there.
#include <algorithm>
#include <cmath>

#include "fit/solver/singular_directions.h"
#include "fit/solver/gauss_newton.h"

namespace selenite {
namespace {

// Source: docs/method/optimisation.md.
constexpr double kLeastValue = 0.003;   ///< of the scaled normal matrix, in a direction
constexpr double kLeastStrength = 0.1;  ///< of Z^T w Z, for scaling
/// From this iteration on caps shrink as 1 / iteration: the way that is left to go stays unlimited
/// (harmonic series), but noise cannot throw a settled fit far and make it forget what it knows.
constexpr double kShrinkFrom = 10;
/// Channels of an extinction differ by about that factor (its logarithm), unless the photos say more.
constexpr double kUnlikeness = 0.5;

}  // namespace

/// What is known before any photo, as another term of the normal matrix: the channels of an
/// extinction are about alike. In units of the sums' noise, so that it gives way to what is seen.
/// Without it a channel that little light comes back from wanders off, and takes its albedo along.
GaussNewton::Matrix GaussNewton::prior() const {
  Matrix prior = Matrix::Zero(normal_.rows(), normal_.cols());
  const auto& components = problem_->unknowns.components();
  for (Eigen::Index k = 0; k + 2 < prior.rows(); ++k) {
    const Component& first = components[static_cast<std::size_t>(k)];
    const bool colour = components[static_cast<std::size_t>(k) + 2].parameter == first.parameter;
    if (first.index != 0 || !colour ||
        !problem_->unknowns.description_of(static_cast<int>(k)).alike)
      continue;
    const double seen = normal_.diagonal()
                            .segment<3>(k)
                            .cwiseMax(kLeastStrength * strength_.segment<3>(k))
                            .cwiseMax(0)
                            .sum();
    if (!(seen > 0)) continue;
    const double noise = covariance_.diagonal().segment<3>(k).sum() / seen;
    prior.block<3, 3>(k, k) = (Eigen::Matrix3d::Identity() - Eigen::Matrix3d::Constant(1.0 / 3)) *
                              (noise / (kUnlikeness * kUnlikeness));
  }
  return prior;
}

bool GaussNewton::is_roughness(Eigen::Index k) const {
  return problem_->unknowns.description_of(static_cast<int>(k)).scale == Scale::kRoughness;
}

/// Step within the caps and the bounds. Components that would leave at a bound are held, and the
/// others solved again without them.
GaussNewton::DampedStep GaussNewton::bounded_step(const Vector& u, bool fix_roughness) const {
  const Matrix normal = normal_ + prior();
  const Vector residual = right_ - normal * u;
  const Vector scale =
      normal.diagonal().cwiseMax(kLeastStrength * strength_).cwiseMax(0).cwiseSqrt();
  std::vector<Eigen::Index> free;
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (scale[k] > 0 && !(fix_roughness && is_roughness(k))) free.push_back(k);  // else: not in any picture
  DampedStep way{Vector::Zero(u.size()), Vector::Zero(u.size())};
  Vector& step = way.step;
  while (!free.empty()) {
    way = free_step(free, normal, residual, scale);
    const auto leaves = [&](Eigen::Index k) {
      return (u[k] <= reparametrization_.minimum()[k] && step[k] < 0) ||
             (u[k] >= reparametrization_.maximum()[k] && step[k] > 0);
    };
    if (std::erase_if(free, leaves) == 0) break;
    way.step.setZero();
    way.remaining.setZero();
  }
  const double longest = std::min(1.0, kShrinkFrom / iteration_);
  const double reach = step.cwiseQuotient(reparametrization_.cap()).cwiseAbs().maxCoeff();
  if (reach > longest) step *= longest / reach;
  step = (u + step).cwiseMax(reparametrization_.minimum()).cwiseMin(reparametrization_.maximum()) - u;
  return way;
}

/// Damped step in the singular directions of the scaled normal matrix, resized where it is noise.
GaussNewton::DampedStep GaussNewton::free_step(const std::vector<Eigen::Index>& free, const Matrix& normal,
                                       const Vector& residual, const Vector& scale) const {
  const Vector inverse = scale(free).cwiseInverse();
  const Matrix scaled = inverse.asDiagonal() * normal(free, free) * inverse.asDiagonal();
  const Matrix noise = inverse.asDiagonal() * covariance_(free, free) * inverse.asDiagonal();
  const SingularDirections directions(scaled);
  const Vector values = directions.values.cwiseMax(kLeastValue);
  const Matrix spread = directions.out.transpose() * noise * directions.out;
  Vector along = directions.out.transpose() * inverse.cwiseProduct(residual(free));
  const Vector whole = along.cwiseQuotient(values);
  for (Eigen::Index j = 0; j < along.size(); ++j) {
    const double square = along[j] * along[j];
    const double trust = square > 0 ? square / (square + spread(j, j)) : 0;
    along[j] *= trust / (values[j] + damping_);
  }
  const Matrix back = directions.in * values.cwiseInverse().asDiagonal();
  const Vector deviation = (back * spread * back.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  DampedStep way{Vector::Zero(scale.size()), Vector::Zero(scale.size())};
  way.step(free) = inverse.cwiseProduct(directions.in * along);
  way.remaining(free) = inverse.cwiseProduct((directions.in * whole).cwiseAbs() + deviation);
  return way;
}

}  // namespace selenite
