// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/refined_point.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/problem/saved_state.h"

namespace selenite {
RefinedPoint::RefinedPoint(const Problem& problem, const GaussNewton* optimiser, Vector x)
    : problem(&problem),
      gauss_newton(optimiser ? *optimiser : GaussNewton(problem)),
      equations(x.size()),
      x(std::move(x)) {}

void RefinedPoint::begin_pass() { equations = NormalEquations(x.size()); }

Estimate RefinedPoint::estimate_here() const {
  return estimate(problem->unknowns, reparametrization(), u, equations, others);
}

Estimate RefinedPoint::end_pass() {
  ++report.passes;
  report.misfit.value = equations.misfit;
  report.misfit.standard_error = std::sqrt(equations.misfit_variance);
  report.misfit.explained = equations.misfit <= kCertainSigmas * report.misfit.standard_error;
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
  contain(problem->unknowns, reparametrization(), at, report.components);
}

bool RefinedPoint::is_roughness(int k) const {
  return problem->unknowns.description_of(k).scale == Scale::kRoughness;
}

void RefinedPoint::members(SavedState& state) {
  state(gauss_newton, equations, u, x, others, report);
}

}  // namespace selenite
