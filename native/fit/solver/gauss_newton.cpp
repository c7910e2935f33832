// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/gauss_newton.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace selenite {
GaussNewton::GaussNewton(const Problem& problem, const GaussNewtonOptions& options)
    : problem_(&problem),
      options_(options),
      reparametrization_(problem.unknowns),
      instruments_(problem.photos.size(), InstrumentalVariables(options.instruments)),
      equations_(problem.unknowns.size()),
      damping_(options.damping) {
  if (!problem.weights)
    own_weights_.emplace(problem.photos, problem.loss.weighted, options.weights);
}

void GaussNewton::members(SavedState& state) {
  if (own_weights_) state(*own_weights_);
  state(instruments_, equations_, damping_, iteration_, converged_, accepted_, weights_version_);
}

Vector GaussNewton::step(const Vector& x, std::span<const Observation> seen) {
  const Vector u = reparametrization_.from_values(x);
  const std::vector<Halves> halves = begin_step(seen);
  const NoisyLoss loss = weights().loss(seen, halves);
  if (damping_.rejects(loss)) {
    accepted_.pop_back();
    return problem_->unknowns.project(reparametrization_.to_values(damping_.best()));
  }
  damping_.accept(damping_.least(done()));
  const double keep = damping_.kept() * (1 - options_.aging / iteration_);
  const double jacobian_kept = add_jacobians(x, seen);
  join(measure(seen, halves), u, keep);
  damping_.note_loss(loss, u);
  return end_step(u, bounded_step(u), seen, jacobian_kept);
}

Vector GaussNewton::step_by_residuals(const Vector& x, std::span<const Observation> seen) {
  if (!has_instruments()) return x;
  const std::vector<Halves> halves = residual_halves(*problem_, seen);
  const Vector u = reparametrization_.from_values(x);
  join(measure(seen, halves), u, options_.follow_kept);
  damping_.raise_to(options_.follow_damping);
  return problem_->unknowns.project(reparametrization_.to_values(u + bounded_step(u, true).step));
}

std::vector<Halves> GaussNewton::begin_step(std::span<const Observation> seen) {
  std::vector<Halves> halves = residual_halves(*problem_, seen);
  ++iteration_;
  converged_ = false;
  follow_weights();
  return halves;
}

void GaussNewton::follow_weights() {
  if (weights().version() == weights_version_) return;
  weights_version_ = weights().version();
  damping_.forget_best();
  // Derivatives lose what a gain makes of the picture by the weights of their time. In other weights
  // they would show it again, far more than its prior does.
  for (std::size_t i = 0; i < instruments_.size(); ++i)
    if (problem_->photos[i].gain_freedom != GainFreedom::kNone)
      instruments_[i] = InstrumentalVariables(options_.instruments);
}

double GaussNewton::add_jacobians(const Vector& x, std::span<const Observation> seen) {
  const double keep = std::max(damping_.kept(), options_.least_jacobian_kept);
  const Vector slope = reparametrization_.slope(x);
  for (const Observation& one : seen)
    instruments_[static_cast<std::size_t>(one.photo)].add(split_halves(*problem_, one, slope),
                                                          keep);
  return keep;
}

bool GaussNewton::has_instruments() const {
  return std::ranges::none_of(instruments_,
                              [](const InstrumentalVariables& one) { return one.empty(); });
}

InstrumentalVariables::Set GaussNewton::instruments(std::size_t i, Denoising denoising) const {
  return instruments_[i].all(problem_->layout, problem_->photos[i], weights()[i], progress(),
                             denoising, problem_->threads);
}

Measurement GaussNewton::measure(std::span<const Observation> seen,
                                 const std::vector<Halves>& halves) const {
  Measurement sum(problem_->unknowns.size());
  for (std::size_t v = 0; v < seen.size(); ++v) {
    const auto i = static_cast<std::size_t>(seen[v].photo);
    sum.add(instruments(i), weights()[i], halves[v]);
  }
  return sum;
}

void GaussNewton::join(const Measurement& now, const Vector& u, double keep) {
  for (Eigen::Index k = 0; k < u.size(); ++k)
    if (!std::isfinite(now.gradient[k]) || !std::isfinite(now.normal(k, k)))
      throw std::runtime_error("The derivative with respect to " +
                               problem_->unknowns.components()[static_cast<std::size_t>(k)].name +
                               " is not finite; narrow its bounds, or report this scene");
  equations_.join(now, u, keep);
}

DampedStep GaussNewton::bounded_step(const Vector& u, bool fix_roughness) const {
  const double longest = std::min(1.0, options_.shrink_from / iteration_);
  return damped_step(equations_, problem_->unknowns, reparametrization_, u,
                     {damping_.damping(), longest, fix_roughness}, options_.step);
}

Vector GaussNewton::end_step(const Vector& u, const DampedStep& step,
                             std::span<const Observation> seen, double jacobian_kept) {
  const Vector next = u + step.step;
  const Vector& cap = reparametrization_.cap();
  converged_ = iteration_ >= options_.least_iterations &&
               (step.remaining.array() <= options_.converged * cap.array()).all();
  damping_.note_step((next - u).cwiseQuotient(cap).cwiseAbs().maxCoeff());
  accepted_.push_back(next);
  if (accepted_.size() > options_.averaged) accepted_.pop_front();
  if (own_weights_) own_weights_->learn(seen, jacobian_kept, iteration_);
  return problem_->unknowns.project(reparametrization_.to_values(next));
}

void GaussNewton::gather(const Vector& x, const Observation& derivatives, double weight) {
  follow_weights();
  instruments_[static_cast<std::size_t>(derivatives.photo)].add(
      split_halves(*problem_, derivatives, reparametrization_.slope(x)), 1, weight);
}

void GaussNewton::gather_picture(std::size_t i, const Halves& residual, double weight) {
  instruments_[i].add_picture(residual, weight);
}

GaussNewton::PhotoEquations GaussNewton::equations(std::size_t i, const Film& residual) const {
  PhotoEquations found{{residual_halves(*problem_, i, residual),
                        instruments(i, Denoising::kRegression), weights()[i]}};
  const Photo& photo = problem_->photos[i];
  if (photo.gain_freedom != GainFreedom::kNone) found.of_photo = residual_halves(residual, photo);
  return found;
}

/// The instruments are kept: their errors slow the way and leave its end.
void GaussNewton::reset_equations() {
  equations_.reset();
  damping_.reset();
  accepted_.clear();
}

/// Pictures of a smooth body change by other slopes than those of a rough one.
void GaussNewton::reset_everything() {
  std::ranges::fill(instruments_, InstrumentalVariables(options_.instruments));
  reset_equations();
}

/// The mean of the last iterates: each still has the noise of its own samples.
Vector GaussNewton::estimate(const Vector& x) const {
  if (accepted_.empty()) return x;
  const auto late =
      static_cast<std::size_t>((1 - options_.damping.late_from) * static_cast<double>(iteration_));
  const std::size_t count = std::min(accepted_.size(), std::max<std::size_t>(late, 1));
  const Vector zero = Vector::Zero(x.size());
  const Vector mean =
      std::accumulate(accepted_.end() - static_cast<std::ptrdiff_t>(count), accepted_.end(), zero) /
      static_cast<double>(count);
  return problem_->unknowns.project(reparametrization_.to_values(mean));
}

}  // namespace selenite
