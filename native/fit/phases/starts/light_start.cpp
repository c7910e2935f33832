// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/starts/light_start.h"

#include "fit/evaluate/seeds.h"
#include "fit/objective/half_buffers.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {

std::unique_ptr<LightStart> LightStart::of(const FitProblem& problem, std::uint64_t seed) {
  if (!problem.fields().has_environment()) return nullptr;
  std::vector<Photo> small;
  for (const Photo& photo : problem.photos())
    small.push_back(photo.resized(LightStartOptions{}.size));
  if (!FieldGaussNewton::applies(problem.fields(), small)) return nullptr;
  return std::unique_ptr<LightStart>(new LightStart(problem, std::move(small), seed));
}

LightStart::LightStart(const FitProblem& problem, std::vector<Photo> photos, std::uint64_t seed)
    : problem_(&problem),
      photos_(std::move(photos)),
      solver_(FieldGaussNewton::of(problem.fields(), photos_,
                                   FieldGaussNewtonOptions::of(problem.settings()))),
      seed_(seed) {
  for (const Photo& photo : photos_) weights_.push_back(relative_weights(photo, photos_.size()));
  solver_->set_values(problem.fields().start());
}

bool LightStart::step(PhotoEvaluator& evaluator) {
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    const int index = static_cast<int>(i);
    const FieldJacobian found = evaluator.field_jacobian(
        {problem_->start().scalars, solver_->values()}, photos_[i], problem_->fields(),
        solver_->shares(i), solver_->cell(), {options_.spp, seed_of(seed_, done_, index)});
    solver_->gather(i, found);
    solver_->add_residual(i, residual_halves(found.film, photos_[i]), weights_[i], options_.kept);
  }
  solver_->solve(fraction());
  solver_->advance(Eigen::VectorXd(0));
  return ++done_ < options_.passes;
}

}  // namespace selenite
