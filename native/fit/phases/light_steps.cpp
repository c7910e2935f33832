// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/light_steps.h"

#include "fit/objective/half_buffers.h"

namespace selenite {

std::unique_ptr<LightSteps> LightSteps::of(const Fields& fields, const std::vector<Photo>& photos) {
  if (!fields.has_environment()) return nullptr;
  Fields lights = fields.only(*fields.environment());
  if (!FieldGaussNewton::applies(lights, photos)) return nullptr;
  return std::unique_ptr<LightSteps>(
      new LightSteps(std::move(lights), *fields.environment(), photos));
}

LightSteps::LightSteps(Fields lights, std::size_t field, const std::vector<Photo>& photos)
    : lights_(std::move(lights)), field_(field), solver_(*FieldGaussNewton::of(lights_, photos)) {}

void LightSteps::begin(const FieldValues& all) { solver_.set_values({all[field_]}); }

Film LightSteps::observe(PhotoEvaluator& evaluator, const Point& point, const Photo& photo,
                         std::size_t i, const Evaluation& how, const Eigen::VectorXf& weight,
                         double keep) {
  FieldJacobian found =
      evaluator.field_jacobian(point, photo, lights_, solver_.shares(i), solver_.cell(), how);
  solver_.gather(i, found);
  solver_.add_residual(i, residual_halves(found.film, photo), weight, keep);
  return std::move(found.film);
}

void LightSteps::step(double done, FieldValues& all) {
  solver_.solve(done);
  solver_.advance(Eigen::VectorXd(0));
  all[field_] = solver_.values().front();
}

}  // namespace selenite
