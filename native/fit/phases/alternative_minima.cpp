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
  newest_.at.x = refinement.values();
  if (!answer_) {
    // Where the validation finds its values worse, the linear step to them went too far.
    if (!run.accept(newest_.at.x, run.validate({newest_.at.x, run.point.fields})))
      refinement.accept(run.result.best);
    newest_.at.x = run.result.best;
    run.result.report = refinement.report();
    const Unknowns& unknowns = run.problem.unknowns();
    simpler_ =
        without_weights(unknowns, Reparametrization(unknowns), newest_.at.x, refinement.report());
  }
  newest_.report = refinement.report();
  weights_ = refinement.weights();
}

std::unique_ptr<MinimaComparison> AlternativeMinima::comparison(const FitRun& run) const {
  std::vector<Vector> alternatives = pending_;
  if (answer_) {
    alternatives.push_back(answer_->at.x);
  } else {
    alternatives = run.problem.unknowns().exchanged(newest_.at.x);
    alternatives.insert(alternatives.end(), candidates_.begin(), candidates_.end());
    if (alternatives.empty() && simpler_.empty()) return nullptr;
  }
  const FitSettings& settings = run.problem.settings();
  return std::make_unique<MinimaComparison>(
      run.problem.scalars(), weights_, Point{newest_.at.x, run.point.fields},
      std::move(alternatives), stream_seed(settings.seed, Stream::kAlternativeMinima, count_, 0),
      settings.chosen_refinement_spp());
}

void AlternativeMinima::take(FitRun& run, const MinimaComparison& comparison) {
  choose(comparison);
  const Vector& x = answer_->at.x;
  if (x != run.result.best) run.accept(x, run.validate({x, run.point.fields}), true);
  report(run, run.result.report);
}

/// Between what has just been refined and the answer so far, if there is another.
void AlternativeMinima::choose(const MinimaComparison& comparison) {
  const auto is_answer = [&](const MinimaComparison::Survivor& one) {
    return answer_ && one.x == answer_->at.x;
  };
  const bool is_simpler = !newest_.at.absent.empty();
  std::vector<MinimaComparison::Survivor> rest = comparison.pending(newest_.report);
  std::erase_if(rest, is_answer);
  for (const MinimaComparison::Survivor& former : comparison.survivors()) {
    if (!is_answer(former)) continue;
    if (is_simpler) {
      if (former.z_score > kLikelySigmas) return;
    } else if (former.far) {
      if (!former.is_better()) equivalent_.push_back(former.z_score > 0 ? newest_ : *answer_);
      if (former.z_score > 0) return;
    }
  }
  // What the former answer may do without says nothing about this one.
  if (answer_) simpler_.clear();
  pending_.clear();
  for (const MinimaComparison::Survivor& one : rest) pending_.push_back(one.x);
  answer_ = newest_;
}

void AlternativeMinima::report(const FitRun& run, TrustReport& report) const {
  report = answer_->report;
  const Reparametrization reparametrization(run.problem.unknowns());
  const Vector& answer = answer_->at.x;
  for (const Vector& x : pending_) mark_ambiguous(report, reparametrization, answer, x, false);
  for (const Refined& one : equivalent_)
    mark_ambiguous(report, reparametrization, answer, one.at.x, true);
  for (const Refined& one : equivalent_) widen(report, one.report);
}

std::optional<Alternative> AlternativeMinima::next() {
  const auto take_first = [&](auto& of) {
    ++count_;
    auto first = std::move(of.front());
    of.erase(of.begin());
    return first;
  };
  if (!simpler_.empty()) {
    newest_.at = take_first(simpler_);
  } else if (!pending_.empty() && others_ < kAlternativeMinima.most_refined) {
    ++others_;
    newest_.at = Alternative{take_first(pending_)};
  } else {
    return std::nullopt;
  }
  return newest_.at;
}

void AlternativeMinima::members(SavedState& state) {
  state(candidates_, newest_, weights_, answer_, simpler_, pending_, equivalent_, count_, others_);
}

}  // namespace selenite
