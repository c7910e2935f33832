// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/absent_weights.h"

#include <Eigen/Cholesky>

namespace selenite {
namespace {

bool may_be_absent(const Unknowns& unknowns, const Vector& x, int k, const Confidence& known) {
  if (!unknowns.description_of(k).optional || unknowns.minimum()[k] > 0 || x[k] == 0) return false;
  return !known.determined || x[k] <= kLikelySigmas * known.standard_error;
}

/// The mean of a normal distribution around `x` where some of its components are 0.
Vector conditional_mean(const Unknowns& unknowns, const Reparametrization& reparametrization,
                        const Vector& x, const Eigen::MatrixXd& covariance,
                        const std::vector<AbsentWeight>& absent) {
  std::vector<Eigen::Index> at;
  for (const AbsentWeight& one : absent) at.push_back(one.component);
  const Vector u = reparametrization.from_values(x);
  Vector step(std::ssize(at));
  for (Eigen::Index i = 0; i < step.size(); ++i) {
    const Eigen::Index k = at[static_cast<std::size_t>(i)];
    step[i] = reparametrization.from_value(k, 0) - u[k];
  }
  const Vector way =
      covariance(Eigen::all, at) * Eigen::MatrixXd(covariance(at, at)).ldlt().solve(step);
  Vector mean = unknowns.project(reparametrization.to_values(u + way));
  for (const Eigen::Index k : at) mean[k] = 0;
  return mean;
}

}  // namespace

std::vector<Alternative> without_weights(const Unknowns& unknowns,
                                         const Reparametrization& reparametrization,
                                         const Vector& x, const TrustReport& report) {
  std::vector<AbsentWeight> all;
  for (int k = 0; k < std::ssize(report.components); ++k) {
    Confidence known = report.components[static_cast<std::size_t>(k)];
    if (!may_be_absent(unknowns, x, k, known)) continue;
    known.interval[0] = 0;
    known.at_bound = AtBound::kMinimum;
    all.push_back({k, known});
  }
  std::vector<std::vector<AbsentWeight>> sets;
  if (!all.empty()) sets.push_back(all);
  if (all.size() > 1)
    for (const AbsentWeight& one : all) sets.push_back({one});
  std::vector<Alternative> found;
  for (std::vector<AbsentWeight>& set : sets) {
    Vector mean = conditional_mean(unknowns, reparametrization, x, report.covariance, set);
    if (mean.allFinite()) found.push_back({std::move(mean), std::move(set)});
  }
  return found;
}

}  // namespace selenite
