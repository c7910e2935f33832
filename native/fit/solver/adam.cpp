// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/adam.h"

#include <cmath>
#include <stdexcept>

#include "fit/problem/saved_state.h"

namespace selenite {

Adam::Adam(const Problem& problem, const AdamOptions& options)
    : problem_(&problem), moments_(problem.unknowns.size(), options) {}

Vector Adam::step(const Vector& x, std::span<const Observation> seen) {
  Vector gradient = Vector::Zero(x.size());
  for (const Observation& one : seen) {
    const Vector part = loss_gradient(problem_->layout, one.film, one.loss);
    for (Eigen::Index k = 0; k < part.size(); ++k)
      if (!std::isfinite(part[k]))
        throw std::runtime_error("The derivative with respect to " +
                                 problem_->unknowns.components()[static_cast<std::size_t>(k)].name +
                                 " in photo '" +
                                 problem_->photos[static_cast<std::size_t>(one.photo)].id +
                                 "' is not finite; narrow its bounds, or report this scene");
    gradient += part / static_cast<double>(seen.size());
  }
  return update(x, gradient);
}

Vector Adam::update(const Vector& x, const Vector& gradient) {
  const Unknowns& unknowns = problem_->unknowns;
  return moments_.update(x, gradient, unknowns.learning_rate(), unknowns.minimum(),
                         unknowns.maximum());
}

void AdamMoments::members(SavedState& state) { state(first_, second_, steps_); }

void Adam::members(SavedState& state) { state(moments_); }

Vector AdamMoments::update(const Vector& x, const Vector& gradient, const Vector& rate,
                           const Vector& minimum, const Vector& maximum) {
  const auto [beta1, beta2, tiny] = options_;
  ++steps_;
  first_ = beta1 * first_ + (1 - beta1) * gradient;
  second_ = beta2 * second_ + (1 - beta2) * gradient.cwiseProduct(gradient);
  const double scale1 = 1 / (1 - std::pow(beta1, steps_));
  const double scale2 = 1 / (1 - std::pow(beta2, steps_));
  Vector next = x;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double root = std::sqrt(second_[k] * scale2);
    next[k] -= rate[k] * first_[k] * scale1 / (root + tiny);
    const double inside = std::fmin(std::fmax(next[k], minimum[k]), maximum[k]);
    // At a bound the momentum has nowhere to go; kept, it would hold the value there for many steps
    // after the gradient has turned.
    if (inside != next[k]) first_[k] = 0;
    next[k] = inside;
  }
  return next;
}

}  // namespace selenite
