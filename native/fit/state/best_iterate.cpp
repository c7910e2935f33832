// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/state/best_iterate.h"

#include <cmath>

#include "fit/state/low_roughness.h"

namespace selenite {

void BestIterate::note(HistoryRow& row, const Validation& validation, FitResult& result) {
  row.validation = validation.unbiased;
  row.validation_standard_error = std::sqrt(validation.variance);
  const bool first = std::isnan(result.best_validation);
  if (first || validation.unbiased < smallest_.unbiased) smallest_ = validation;
  if (is_worse(validation, smallest_, 1)) return;
  if (!first && yields(row.values, validation, result)) return;
  best_ = validation;
  result.best = row.values;
  result.fields_best = result.fields_last;
  result.best_iteration = row.iteration;
  result.best_validation = row.validation;
  result.best_validation_standard_error = row.validation_standard_error;
}

void BestIterate::reweigh(const FitProblem& problem, FitResult& result) {
  for (Validation* one : {&smallest_, &best_, &start_})
    if (!one->parts.empty()) {
      Validation judged = judge(problem, one->films, one->gains);
      judged.alignments = std::move(one->alignments);
      *one = std::move(judged);
    }
  if (best_.parts.empty()) return;
  result.best_validation = best_.unbiased;
  result.best_validation_standard_error = std::sqrt(best_.variance);
}

bool BestIterate::may_yield(const Vector& x, const FitResult& result) const {
  return prefers_low_roughness_ && !is_low_roughness(*unknowns_, x) &&
         is_low_roughness(*unknowns_, result.best);
}

bool BestIterate::yields(const Vector& x, const Validation& validation,
                         const FitResult& result) const {
  return may_yield(x, result) && !best_.parts.empty() && explains_as_well(best_, validation);
}

}  // namespace selenite
