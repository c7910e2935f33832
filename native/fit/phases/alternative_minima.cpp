// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/alternative_minima.h"

#include <algorithm>
#include <utility>

#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

/// Intervals that contain both.
void widen(TrustReport& report, const TrustReport& other) {
  for (std::size_t k = 0; k < report.components.size(); ++k) {
    Confidence& one = report.components[k];
    const Confidence& equivalent = other.components[k];
    if (!one.determined || !equivalent.determined) continue;
    one.interval[0] = std::min(one.interval[0], equivalent.interval[0]);
    one.interval[1] = std::max(one.interval[1], equivalent.interval[1]);
    one.standard_error = std::max(one.standard_error, equivalent.standard_error);
  }
}

}  // namespace

void AlternativeMinima::take(FitRun& run, Refinement& refinement) {
  newest_.x = refinement.values();
  if (!answer_) {
    // Where the validation finds its values worse, the linear step to them went too far.
    if (!run.accept(newest_.x, run.validate({newest_.x, run.point.fields})))
      refinement.accept(run.result.best);
    newest_.x = run.result.best;
    run.result.report = refinement.report();
  }
  newest_.report = refinement.report();
  weights_ = refinement.weights();
}

std::unique_ptr<MinimaComparison> AlternativeMinima::comparison(const FitRun& run) const {
  std::vector<Vector> alternatives = pending_;
  if (answer_) {
    alternatives.push_back(answer_->x);
  } else {
    alternatives = run.problem.unknowns().exchanged(newest_.x);
    alternatives.insert(alternatives.end(), candidates_.begin(), candidates_.end());
  }
  if (alternatives.empty()) return nullptr;
  const FitSettings& settings = run.problem.settings();
  return std::make_unique<MinimaComparison>(
      run.problem.scalars(), weights_, Point{newest_.x, run.point.fields}, std::move(alternatives),
      stream_seed(settings.seed, Stream::kAlternativeMinima, count_, 0),
      settings.chosen_refinement_spp());
}

void AlternativeMinima::take(FitRun& run, const MinimaComparison& comparison) {
  choose(comparison);
  if (answer_->x != run.result.best)
    run.accept(answer_->x, run.validate({answer_->x, run.point.fields}), true);
  report(run, run.result.report);
}

/// Between what has just been refined and the answer so far, if there is another.
void AlternativeMinima::choose(const MinimaComparison& comparison) {
  const auto is_answer = [&](const MinimaComparison::Survivor& one) {
    return answer_ && one.x == answer_->x;
  };
  std::vector<MinimaComparison::Survivor> rest = comparison.pending(newest_.report);
  std::erase_if(rest, is_answer);
  for (const MinimaComparison::Survivor& former : comparison.survivors()) {
    if (!is_answer(former)) continue;
    if (!former.is_better()) equivalent_.push_back(former.z_score > 0 ? newest_ : *answer_);
    if (former.z_score > 0) return;
  }
  pending_.clear();
  for (const MinimaComparison::Survivor& one : rest) pending_.push_back(one.x);
  answer_ = newest_;
}

void AlternativeMinima::report(const FitRun& run, TrustReport& report) const {
  report = answer_->report;
  const Reparametrization reparametrization(run.problem.unknowns());
  for (const Vector& x : pending_) mark_ambiguous(report, reparametrization, answer_->x, x, false);
  for (const Refined& one : equivalent_)
    mark_ambiguous(report, reparametrization, answer_->x, one.x, true);
  for (const Refined& one : equivalent_) widen(report, one.report);
}

std::optional<Vector> AlternativeMinima::next() {
  if (pending_.empty() || count_ == kAlternativeMinima.most_refined) return std::nullopt;
  ++count_;
  Vector x = std::move(pending_.front());
  pending_.erase(pending_.begin());
  return x;
}

void AlternativeMinima::members(SavedState& state) {
  state(candidates_, newest_, weights_, answer_, pending_, equivalent_, count_);
}

}  // namespace selenite
