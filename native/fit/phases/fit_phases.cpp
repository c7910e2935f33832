// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit does before its first iteration and after its last.
#include <algorithm>
#include <cmath>
#include <memory>

#include "fit/run/fit.h"
#include "fit/evaluate/seeds.h"
#include "math/error.h"

namespace selenite {
namespace {

/// Share of a refinement that is over when the answer is compared with its alternatives.
constexpr double kBeforeComparison = 0.9;
/// AlternativeMinima that are verified, too, at most.
constexpr int kMostAlternatives = 2;
/// Intervals that hold whichever of the two is right.
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

const char* phase_text(Phase phase) {
  switch (phase) {
    case Phase::kMultiStart:
      return "multi-start";
    case Phase::kRefinement:
      return "refinement";
    default:
      return "descent";
  }
}

RenderAt Fit::renderer(Subject subject, Progress* progress) {
  return [this, subject = std::move(subject), progress](const Vector& x, const Photo& photo,
                                                        int spp, std::uint64_t seed,
                                                        std::optional<Differences> which) {
    // MultiStart and refinement take Gauss-Newton steps whatever the iterations do.
    if (which)
      return derivatives(subject, x, photo, spp, seed, Purpose::kInstrumental, *which, progress);
    const Scene scene = subject.scene_at(x);
    Film film = settings_.renderer(scene, scene.camera(photo.camera), SlotLayout(),
                                   render_settings(photo, spp, seed), progress);
    count(film, photo);
    return film;
  };
}

void Fit::begin_multi_start(const OptimiserKind& kind, const std::vector<UnknownParameter>& wanted) {
  if (settings_.search == "off") return;
  if (alternates_)
    uniform_ = UniformFields::of(scene_, wanted, fields_, photos_, loss_, settings_.iterations);
  const bool few = fields_.empty() ? unknowns_.size() <= kFewUnknowns : uniform_ != nullptr;
  if (settings_.search == "auto" && !(kind.few_unknowns && few)) return;
  if (!few)
    throw InvalidArgument(
        "search = 'on' is for up to " + std::to_string(kFewUnknowns) +
        " unknowns, where an albedo grid or image that starts with one colour "
        "counts as three and any other as too many; choose search = 'off' or 'auto'");
  multi_start_ = std::make_unique<MultiStart>(uniform_ ? uniform_->problem() : problem_,
                                     stream_seed(settings_.seed, Stream::kMultiStart, 0, 0));
  result_.phase = Phase::kMultiStart;
}

bool Fit::run_multi_start(Progress* progress) {
  const Subject about =
      uniform_ ? Subject{uniform_->problem(), reparametrization_ ? &uniform_->reparametrization() : nullptr,
                      [this](const Vector& x) { return uniform_->scene_at(x); }}
            : subject(field_values_);
  const bool more = multi_start_->step(renderer(about, progress));
  result_.phase_fraction = multi_start_->fraction();
  if (too_many_dropped()) return false;
  if (more) return true;
  x_ = multi_start_->values();
  result_.search = multi_start_->result();
  if (uniform_) {
    field_values_ = uniform_->fields(x_);
    result_.fields_last = result_.fields_best = std::make_shared<FieldValues>(field_values_);
    x_ = uniform_->scalars(x_);
    searched_ = true;
    if (settings_.accumulate) field_gauss_newton_ = FieldGaussNewton::of(fields_, photos_);
    if (field_gauss_newton_) field_gauss_newton_->set_values(field_values_);
  } else {
    others_ = multi_start_->others();
  }
  multi_start_.reset();
  result_.last = result_.best = x_;
  result_.phase = Phase::kDescent;
  return true;
}

bool Fit::wants_refinement() const {
  if (settings_.refinement != "auto") return settings_.refinement == "on";
  return (fields_.empty() || field_gauss_newton_) && unknowns_.size() <= kFewUnknowns &&
         loss_.least_squares &&
         choose_optimiser("auto", unknowns_.size(), loss_, settings_.spp, settings_.accumulate)
             .few_unknowns;
}

/// Beside fields nothing tells a sharp body from a sharper one, but lamps that are seen in it are found
/// the less often.
void Fit::start_refinement() {
  Vector x = result_.best;
  if (field_gauss_newton_) {
    field_values_ = *result_.fields_best;
    field_gauss_newton_->set_values(field_values_);
    for (int k = 0; k < unknowns_.size(); ++k)
      if (unknowns_.description_of(k).scale == Scale::kRoughness)
        x[k] = std::max(x[k], kLowRoughness);
    x = unknowns_.project(x);
  }
  refine_from(x, optimiser_.get());
}

void Fit::refine_from(const Vector& x, const Optimiser* optimiser) {
  int spp = settings_.chosen_refinement_spp();
  if (field_gauss_newton_ && settings_.refinement_spp == 0)
    spp /= 5;  // the others are for the few pixels in focus
  refinement_ = std::make_unique<Refinement>(
      problem_, optimiser, x,
      stream_seed(settings_.seed, Stream::kRefinement, refined_alternatives_, 0), spp, settings_.spp,
      field_gauss_newton_.get());
  result_.phase = Phase::kRefinement;
  note_refinement(0);
}

/// Share of this look; those before took as long.
void Fit::note_refinement(double fraction) {
  result_.phase_fraction = (refined_alternatives_ + fraction) / (refined_alternatives_ + 1);
}

bool Fit::refine(Progress* progress) {
  const bool more = refinement_->step(renderer(subject(field_values_), progress));
  note_refinement(refinement_->fraction() * kBeforeComparison);
  if (field_gauss_newton_) {
    field_values_ = field_gauss_newton_->values();
    result_.fields_last = std::make_shared<FieldValues>(field_values_);
  }
  if (too_many_dropped()) return false;
  if (more) return true;
  std::vector<Vector> alternatives;
  refined_.x = refinement_->values();
  if (accepted_) {
    alternatives = pending_;
    alternatives.push_back(accepted_->x);
  } else {
    // Where the validation finds its values worse, the linear step to them went too far.
    if (!accept(refined_.x, validate(refined_.x, field_values_, progress)))
      refinement_->accept(result_.best);
    refined_.x = result_.best;
    result_.report = refinement_->report();
    alternatives = unknowns_.exchanged(result_.best);
    alternatives.insert(alternatives.end(), others_.begin(), others_.end());
  }
  refined_.report = refinement_->report();
  // Those beside fields would need fields of their own.
  if (alternatives.empty() || field_gauss_newton_) {
    note_refinement(1);
    return stop_after_iterations();
  }
  alternative_minima_ =
      std::make_unique<AlternativeMinima>(problem_, refinement_->weights(), refined_.x, std::move(alternatives),
                               stream_seed(settings_.seed, Stream::kAlternativeMinima, refined_alternatives_, 0),
                               settings_.chosen_refinement_spp());
  return true;
}

bool Fit::compare_alternatives(Progress* progress) {
  const bool more = alternative_minima_->step(renderer(subject(field_values_), progress));
  note_refinement(kBeforeComparison + (1 - kBeforeComparison) * alternative_minima_->fraction());
  if (too_many_dropped()) return false;
  if (more) return true;
  choose_minimum();
  alternative_minima_.reset();
  if (accepted_->x != result_.best)
    accept(accepted_->x, validate(accepted_->x, field_values_, progress), true);
  report_alternatives();
  if (pending_.empty() || refined_alternatives_ == kMostAlternatives) return stop_after_iterations();
  // At the bottom of its basin it may win or lose. Instruments of other values say little about it.
  ++refined_alternatives_;
  refine_from(pending_.front(), nullptr);
  pending_.erase(pending_.begin());
  return true;
}

/// Between what has just been verified and the answer so far, if there is another.
void Fit::choose_minimum() {
  const auto is_answer = [&](const AlternativeMinima::Survivor& one) {
    return accepted_ && one.x == accepted_->x;
  };
  std::vector<AlternativeMinima::Survivor> rest = alternative_minima_->pending(refined_.report);
  std::erase_if(rest, is_answer);
  for (const AlternativeMinima::Survivor& former : alternative_minima_->survivors()) {
    if (!is_answer(former)) continue;
    if (!former.is_better()) equivalent_.push_back(former.z_score > 0 ? refined_ : *accepted_);
    if (former.z_score > 0) return;
  }
  pending_.clear();
  for (const AlternativeMinima::Survivor& one : rest) pending_.push_back(one.x);
  accepted_ = refined_;
}

void Fit::report_alternatives() {
  result_.report = accepted_->report;
  const Reparametrization reparametrization(unknowns_);
  for (const Vector& x : pending_) mark_ambiguous(result_.report, reparametrization, accepted_->x, x, false);
  for (const Refined& one : equivalent_)
    mark_ambiguous(result_.report, reparametrization, accepted_->x, one.x, true);
  for (const Refined& one : equivalent_) widen(result_.report, one.report);
}

bool Fit::stop_after_iterations() {
  return stop(result_.iterations < all_iterations() ? StopReason::kConverged
                                                    : StopReason::kIterations);
}

}  // namespace selenite
