// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/refined_point.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/inference/expansion_point.h"
#include "fit/inference/offset_expansion.h"
#include "fit/inference/weak_directions.h"
#include "fit/problem/saved_state.h"

namespace selenite {
namespace {

/// Squared share of the brightness: below, photos differ by what blurs and bright pixels do, too, and more
/// samples still bring the values nearer.
constexpr double kWrongModel = 0.05 * 0.05;

}  // namespace

RefinedPoint::RefinedPoint(const Problem& problem, std::unique_ptr<GaussNewton> optimiser, Vector x)
    : problem(&problem),
      gauss_newton(optimiser ? std::move(*optimiser) : GaussNewton(problem)),
      equations(x.size()),
      x(std::move(x)),
      gain_slopes(problem) {}

void RefinedPoint::begin_pass() { equations = NormalEquations(x.size()); }

void RefinedPoint::gather(const Observation& derivatives, double weight) {
  gauss_newton.gather(x, derivatives, weight);
  gain_slopes.add(*problem, derivatives, reparametrization().slope(x), weight);
}

Estimate RefinedPoint::estimate_here() const {
  Estimate now = estimate(problem->unknowns, reparametrization(), u, equations, with_fixed(others));
  if (report.misfit.explained || report.misfit.value < kWrongModel)
    for (Confidence& one : now.components) one.lasting = 0;
  return now;
}

OtherPasses RefinedPoint::with_fixed(OtherPasses with) const {
  with.known.resize(std::max(with.known.size(), fixed.size()));
  for (std::size_t i = 0; i < fixed.size(); ++i)
    if (fixed[i]) with.known[i] = fixed[i];
  return with;
}

std::optional<Vector> RefinedPoint::offset_of_free() const {
  std::optional<Vector> there = offset_point(problem->unknowns, x);
  for (std::size_t i = 0; there && i < fixed.size(); ++i)
    if (fixed[i]) (*there)[static_cast<Eigen::Index>(i)] = fixed[i]->value;
  if (there == x) return std::nullopt;
  return there;
}

Estimate RefinedPoint::end_pass() {
  ++report.passes;
  equations.score_covariance += gain_slopes.prior_covariance();
  report.misfit.value = equations.shared.relative();
  report.misfit.standard_error = equations.shared.relative_error();
  report.misfit.explained = report.misfit.value <= kCertainSigmas * report.misfit.standard_error;
  return estimate_here();
}

double RefinedPoint::reach_of(const Estimate& now) const {
  return now.step.cwiseQuotient(reparametrization().cap()).cwiseAbs().maxCoeff();
}

Vector RefinedPoint::apply(const Estimate& now) {
  const Vector step = now.step / std::max(1.0, reach_of(now));
  x = problem->unknowns.project(reparametrization().to_values(u + step));
  Vector way = reparametrization().from_values(x) - u;
  report_components(now, x);
  return way;
}

void RefinedPoint::widen(const Vector& way, const Vector& at) {
  others.unsure_step = way;
  report_components(estimate_here(), at);
}

void RefinedPoint::accept(const Vector& accepted) {
  // The intervals are about where the whole step leads, x only as far along it as one may go.
  const Vector end = u + estimate_here().step;
  for (std::size_t i = 0; i < others.known.size(); ++i)
    if (std::optional<Known>& one = others.known[i])
      one->value = accepted[static_cast<Eigen::Index>(i)];
  widen(end - reparametrization().from_values(accepted), accepted);
}

void RefinedPoint::report_components(const Estimate& now, const Vector& at) {
  report.components = now.components;
  report.covariance = now.covariance;
  report.gain_slopes = gain_slopes.slopes();
  report.weak = weak_directions(now.covariance, ranges(), report.gain_slopes);
  contain(problem->unknowns, reparametrization(), at, report.components);
}

/// How far each component may go, in `Reparametrization`.
Vector RefinedPoint::ranges() const {
  const ExpansionPoint point{problem->unknowns, reparametrization(), x, kConfidence};
  Vector range(x.size());
  for (Eigen::Index k = 0; k < x.size(); ++k) range[k] = point.range(k);
  return range;
}

bool RefinedPoint::is_roughness(int k) const {
  return problem->unknowns.description_of(k).scale == Scale::kRoughness;
}

void RefinedPoint::members(SavedState& state) {
  state(gauss_newton, equations, u, x, gain_slopes, others, fixed, report);
}

}  // namespace selenite
