// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/solver/joint_gauss_newton.h"

#include <algorithm>

#include "fit/problem/saved_state.h"

namespace selenite {

JointGaussNewton::JointGaussNewton(const Problem& problem, const Fields& fields,
                                   const FieldValues& start, const GaussNewtonOptions& options,
                                   const FieldGaussNewtonOptions& field_options)
    : problem_(&problem),
      aging_(options.aging),
      numbers_kept_(field_options.numbers_kept),
      scalars_(problem, options),
      fields_(*FieldGaussNewton::of(fields, problem.photos, field_options)) {
  fields_.set_values(start);
}

/// A sample that is bright by chance has large derivatives by texels, too: residuals meet those of other
/// samples.
void JointGaussNewton::gather_fields(std::size_t i, FieldJacobian derivatives, double samples) {
  if (fields_.has_images())
    waiting_.push_back({i, std::move(derivatives), samples});
  else
    fields_.gather(i, derivatives, samples);
}

void JointGaussNewton::gather_waiting() {
  for (const Waiting& one : waiting_) fields_.gather(one.photo, one.derivatives, one.samples);
  waiting_.clear();
}

Vector JointGaussNewton::step(const Vector& x, std::span<const Observation> seen) {
  const Vector u = scalars_.reparametrization().from_values(x);
  const std::vector<Halves> halves = scalars_.begin_step(seen);
  add_residuals(seen);
  scalars_.damping().accept(scalars_.damping().least(scalars_.done()));
  const double keep = kept(++joined_);
  const double jacobian_kept = scalars_.add_jacobians(x, seen);
  scalars_.join(measure(seen, halves), u, keep);
  const DampedStep step = scalars_.bounded_step(u);
  fields_.advance(step.step);
  gather_waiting();
  return scalars_.end_step(u, step, seen, jacobian_kept);
}

/// Along a narrow valley, in which steps of scalars and fields in turns are slow.
Vector JointGaussNewton::step_by_residuals(const Vector& x, std::span<const Observation> seen,
                                           double samples) {
  const std::vector<Halves> halves = residual_halves(*problem_, seen);
  add_residuals(seen, samples);
  if (!scalars_.has_instruments()) {
    // Light is linear, and scalars go astray beside even texels: both go ahead of what is not.
    if (fields_.has_environment() || fields_.has_images()) {
      fields_.solve(has_scalars() ? scalars_.done() : 1);
      fields_.advance(Eigen::VectorXd(0));
    }
    if (!has_scalars()) ++joined_;
    gather_waiting();
    return x;
  }
  const Reparametrization& reparametrization = scalars_.reparametrization();
  const Vector u = reparametrization.from_values(x);
  const Measurement now = measure(seen, halves);
  scalars_.join(now, u, kept(++joined_));
  scalars_.damping().raise_to(scalars_.damping().least(scalars_.done()));
  const DampedStep step = scalars_.bounded_step(u, true);
  fields_.advance(step.step);
  gather_waiting();
  const Vector next = u + step.step;
  scalars_.damping().note_step(
      (next - u).cwiseQuotient(reparametrization.cap()).cwiseAbs().maxCoeff());
  return problem_->unknowns.project(reparametrization.to_values(next));
}

bool JointGaussNewton::has_scalars() const { return problem_->unknowns.size() > 0; }

double JointGaussNewton::kept(int joined) const {
  const double kept = scalars_.damping().kept() * (1 - aging_ / joined);
  return has_scalars() || !fields_.has_numbers() ? kept : std::min(kept, numbers_kept_);
}

/// Their Jacobian has the gains in it. These minimise the photos and the prior together, so the slope by a
/// voxel is that at a fixed gain, without the prior.
void JointGaussNewton::add_residuals(std::span<const Observation> seen, double samples) {
  for (const Observation& one : seen) {
    const auto i = static_cast<std::size_t>(one.photo);
    fields_.add_residual(i, residual_halves(one.film, problem_->photos[i]), scalars_.weights()[i],
                         kept(joined_ + 1), samples);
  }
}

Measurement JointGaussNewton::measure(std::span<const Observation> seen,
                                      const std::vector<Halves>& halves) {
  std::vector<InstrumentalVariables::Set> z;
  std::vector<FieldGaussNewton::Regressors> regressors;
  for (const Observation& one : seen)
    z.push_back(scalars_.instruments(static_cast<std::size_t>(one.photo)));
  const auto weight = [&](std::size_t k) -> const Eigen::VectorXf& {
    return scalars_.weights()[static_cast<std::size_t>(seen[k].photo)];
  };
  Measurement sum(problem_->unknowns.size());
  std::vector<Halves> of_photos;
  for (std::size_t k = 0; k < seen.size(); ++k) {
    regressors.push_back({&z[k], &weight(k)});
    const Photo& photo = problem_->photos[static_cast<std::size_t>(seen[k].photo)];
    of_photos.push_back(residual_halves(seen[k].film, photo));
    if (photo.gain_freedom == GainFreedom::kNone) continue;
    // Voxels do not make up for the prior of a gain: its slope is by the instruments as they are.
    Halves prior = halves[k];
    prior.residual_a -= of_photos[k].residual_a;
    prior.residual_b -= of_photos[k].residual_b;
    sum.add_gradient(z[k], weight(k), prior);
  }
  fields_.solve(scalars_.done());
  (void)fields_.eliminate_fields(regressors);  // a step follows what is known, whatever is not
  for (std::size_t k = 0; k < seen.size(); ++k) sum.add(z[k], weight(k), of_photos[k]);
  return sum;
}

Eigen::MatrixXd JointGaussNewton::eliminate_fields(std::vector<GaussNewton::PhotoEquations>& all,
                                                   FieldGaussNewton& fields, double done,
                                                   double keep) {
  std::vector<FieldGaussNewton::Regressors> z;
  for (std::size_t i = 0; i < all.size(); ++i) {
    GaussNewton::WeightedResidual& whole = all[i].whole;
    fields.add_residual(i, all[i].of_photo ? *all[i].of_photo : whole.residual, whole.weight, keep);
    z.push_back({&whole.z, &whole.weight});
    if (const auto& informative = all[i].informative) {
      z.back().informative = &informative->z;
      z.back().informative_weight = &informative->weight;
    }
    if (fields.has_images()) z.back().widening = &all[i].widening;
  }
  fields.solve(done);
  return fields.eliminate_fields(z);
}

void JointGaussNewton::members(SavedState& state) { state(scalars_, fields_, joined_); }

}  // namespace selenite
