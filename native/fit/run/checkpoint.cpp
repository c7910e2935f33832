// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/run/fit.h"
#include "fit/problem/saved_state.h"
#include "math/error.h"

namespace selenite {

void HistoryRow::members(SavedState& state) {
  state(iteration, values, loss, validation, validation_standard_error, mean_bias, field_means);
}

void Fit::Validation::members(SavedState& state) { state(loss, unbiased, variance, parts, bias); }

/// What the state belongs to: with anything else it would be misread.
std::string Fit::fingerprint() const {
  std::string text = "7 " + optimiser_name_ + " " + settings_.loss;
  for (const std::int64_t number :
       {static_cast<std::int64_t>(settings_.seed), std::int64_t{settings_.iterations},
        std::int64_t{settings_.spp}, std::int64_t{settings_.depth},
        std::int64_t{settings_.accumulate}, std::int64_t{settings_.validation_interval},
        std::int64_t{settings_.chosen_validation_spp()}, std::int64_t{settings_.finite_differences}})
    text += " " + std::to_string(number);
  text += " " + settings_.search;
  for (const Component& component : unknowns_.components()) text += "\n" + component.name;
  for (std::size_t f = 0; f < fields_.names().size(); ++f)
    text += "\n" + fields_.names()[f] + " " + std::to_string(fields_.start()[f].size());
  for (const Photo& photo : photos_) text += "\n" + std::to_string(photo.fingerprint());
  return text;
}

void Fit::members(SavedState& state) {
  std::string print = fingerprint();
  state(print);
  if (print != fingerprint())
    throw InvalidArgument(
        "The saved state belongs to a fit of other settings, unknowns or photos; start without it");
  FieldValues last = *result_.fields_last, best = *result_.fields_best;
  state(x_, field_values_, field_means_, field_adam_, searched_, smallest_, best_, first_dropped_,
        last, best);
  state(result_.last, result_.best, result_.best_iteration, result_.best_validation,
        result_.best_validation_standard_error, result_.iterations, result_.samples,
        result_.dropped, result_.cpu_seconds, result_.history);
  state(result_.search.points, result_.search.moved, result_.search.start_loss, result_.search.loss,
        result_.search.standard_error, others_);
  optimiser_->members(state);
  bool has_newton = field_gauss_newton_ != nullptr;
  state(has_newton);
  if (state.reading()) field_gauss_newton_ = has_newton ? FieldGaussNewton::of(fields_, photos_) : nullptr;
  if (field_gauss_newton_) state(*field_gauss_newton_);
  if (!state.reading()) return;
  state.expect_end();
  multi_start_.reset();
  result_.phase = Phase::kDescent;
  result_.fields_last = std::make_shared<FieldValues>(std::move(last));
  result_.fields_best = std::make_shared<FieldValues>(std::move(best));
}

std::string Fit::saved() {
  SavedState state;
  members(state);
  return state.sealed();
}

void Fit::restore(std::string_view saved) {
  if (result_.iterations > 0)
    throw InvalidArgument("Fit.restore: this fit has begun; restore a new one");
  SavedState state(saved);
  members(state);
  // A look at the answer leaves no trace until it is over: it is begun again.
  if (result_.iterations >= all_iterations() && wants_refinement()) start_refinement();
}

}  // namespace selenite
