// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/ior_line_search.h"

#include "math/overloaded.h"
#include "math/parabolic_line_search.h"

namespace selenite {

std::vector<int> IorLineSearch::components(const Vector& x) const {
  std::vector<int> found;
  if (!enabled_) return found;
  const Unknowns& unknowns = problem_->unknowns();
  const Scene scene = problem_->scene_at(x);
  for (int k = 0; k < unknowns.size(); ++k) {
    const Component& one = unknowns.components()[static_cast<std::size_t>(k)];
    const bool sharp = std::visit(
        Overloaded{[&](const ParameterRef& ref) { return is_sharp_refraction(scene, ref); },
                   [](const PhotoParameterRef&) { return false; }},
        unknowns.parameters()[static_cast<std::size_t>(one.parameter)]);
    if (sharp) found.push_back(k);
  }
  return found;
}

Vector IorLineSearch::apply(Vector x, FitRun& run) const {
  const Unknowns& unknowns = problem_->unknowns();
  const Reparametrization reparametrization(unknowns);
  for (const int k : components(x)) {
    Vector u = reparametrization.from_values(x);
    const auto at = [&](double coordinate) {
      u[k] = coordinate;
      return unknowns.project(reparametrization.to_values(u));
    };
    const auto loss = [&](double coordinate) {
      return run.validate({at(coordinate), run.point.fields}, problem_->settings().spp).unbiased;
    };
    const double found = parabolic_line_search(
        loss, u[k],
        {options_.step, reparametrization.minimum()[k], reparametrization.maximum()[k]});
    x[k] = at(found)[k];
  }
  return x;
}

}  // namespace selenite
