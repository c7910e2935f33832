// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/phase.h"

#include <limits>

namespace selenite {
namespace {

constexpr double kNotDone = std::numeric_limits<double>::quiet_NaN();
constexpr double kAverageSigmas = 2;  ///< standard errors of a validation

}  // namespace

FitRun::FitRun(const FitProblem& problem, const Strategy& strategy)
    : problem(problem),
      strategy(strategy),
      point(problem.start()),
      best(problem.unknowns(), strategy.after_multi_start() && !strategy.joint),
      previews(problem.photos().size()),
      evaluator(scene_model(problem), problem.settings(), result) {
  result.last = result.best = point.scalars;
  result.fields_last = result.fields_best = std::make_shared<FieldValues>(point.fields);
  result.best_validation = result.best_validation_standard_error = kNotDone;
}

Validation FitRun::validate(const Point& at, int spp) {
  return selenite::validate(problem, evaluator, at, spp, previews);
}

HistoryRow FitRun::row(const Point& at) const {
  return {
      result.iterations, at.scalars, 0, kNotDone, kNotDone, {}, problem.fields().means(at.fields)};
}

bool FitRun::accept(const Vector& x, const Validation& validation, bool confirmed) {
  point.scalars = result.last = x;
  HistoryRow next = row(point);
  next.loss = validation.loss;
  next.mean_bias = validation.bias;
  best.note(next, validation, result);
  // An estimate that draws on all iterations yields to an earlier state only if that is better by more
  // than the noise of the comparison.
  if (confirmed || (strategy.estimates_by_all_iterations() &&
                    next.validation <
                        result.best_validation + kAverageSigmas * next.validation_standard_error)) {
    result.best_validation = kNotDone;
    best.note(next, validation, result);
  }
  const bool is_best = result.best == next.values;
  result.history.push_back(std::move(next));
  return is_best;
}

bool FitRun::stop(StopReason reason, std::string message) {
  result.stopped = reason;
  result.message = std::move(message);
  return false;
}

bool FitRun::stop_if_dropped() {
  if (!result.too_many_dropped()) return false;
  stop(StopReason::kDropped, result.dropped_text());
  return true;
}

}  // namespace selenite
