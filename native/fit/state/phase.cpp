// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/phase.h"

#include <cmath>
#include <limits>

#include "fit/objective/gain_slopes.h"
#include "fit/objective/photo_weights.h"

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
  result.patterns.assign(point.fields.size(), {kNotDone, 0});
  result.fields_last = result.fields_best = std::make_shared<FieldValues>(point.fields);
  result.best_validation = result.best_validation_standard_error = result.start_validation =
      kNotDone;
}

Validation FitRun::validate(const Point& at, int spp) {
  return selenite::validate(problem, evaluator, at, spp, previews);
}

void FitRun::follow_weights() {
  const int version = problem.scalars().weights->version();
  if (version == weights_version_) return;
  weights_version_ = version;
  result.model_error = problem.scalars().weights->model_error();
  best.reweigh(problem, result);
}

void FitRun::keep_start_if_best() {
  if (!best.has_start() || std::isnan(result.best_validation)) return;
  result.start_validation = best.start().unbiased;
  if (!is_worse(best.validation(), best.start(), 1)) return;
  const Point start = problem.start();
  result.best = start.scalars;
  result.fields_best = std::make_shared<FieldValues>(start.fields);
  result.best_iteration = 0;
  best.keep_start();
  result.best_validation = best.start().unbiased;
  result.best_validation_standard_error = std::sqrt(best.start().variance);
  result.kept_start = true;
  if (!result.report.components.empty())
    contain(problem.unknowns(), Reparametrization(problem.unknowns()), result.best,
            result.report.components);
}

void FitRun::members(SavedState& state) {
  state(point, result, best, weights_version_, *problem.scalars().weights, evaluator);
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

void FitRun::explain_fields() {
  if (problem.fields().vertices() || std::isnan(result.best_validation)) return;
  const double seen = std::max(result.best_validation, 0.0);
  for (std::size_t f = 0; f < result.patterns.size(); ++f) {
    Point even{result.best, *result.fields_best};
    even.fields[f] = problem.fields().evened(f, even.fields[f]);
    Previews unseen(previews.size());
    const double without = selenite::validate(problem, evaluator, even,
                                              problem.settings().chosen_validation_spp(), unseen)
                               .unbiased;
    if (without > 0) result.patterns[f].explained = std::max(0.0, 1 - seen / without);
  }
}

bool FitRun::stop(StopReason reason, std::string message) {
  keep_start_if_best();
  if (!best.validation().parts.empty()) report_photos();
  result.stopped = reason;
  result.message = std::move(message);
  return false;
}

void FitRun::report_photos() {
  result.photos = selenite::report_photos(problem, best.validation());
  const TrustReport& report = result.report;
  for (std::size_t i = 0; i < report.gain_slopes.size(); ++i)
    if (PhotoReport& one = result.photos[i]; problem.photos()[i].gain_freedom != GainFreedom::kNone)
      one.gain_error =
          joint_gain_error(one.gain, one.gain_error, report.gain_slopes[i], report.covariance);
}

bool FitRun::stop_if_dropped() {
  if (!result.too_many_dropped()) return false;
  stop(StopReason::kDropped, result.dropped_text());
  return true;
}

}  // namespace selenite
