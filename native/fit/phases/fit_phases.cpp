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

/// Share of a verification that is over when the answer is compared with its rivals.
constexpr double kBeforeRivals = 0.9;
/// Rivals that are verified, too, at most.
constexpr int kMostRivals = 2;
/// Intervals that hold whichever of the two is right.
void widen(TrustReport& report, const TrustReport& other) {
  for (std::size_t k = 0; k < report.components.size(); ++k) {
    Confidence& one = report.components[k];
    const Confidence& as_good = other.components[k];
    if (!one.determined || !as_good.determined) continue;
    one.interval[0] = std::min(one.interval[0], as_good.interval[0]);
    one.interval[1] = std::max(one.interval[1], as_good.interval[1]);
    one.standard_error = std::max(one.standard_error, as_good.standard_error);
  }
}

}  // namespace

const char* phase_text(Phase phase) {
  switch (phase) {
    case Phase::kSearching:
      return "searching";
    case Phase::kVerifying:
      return "verifying";
    default:
      return "fitting";
  }
}

RenderAt Fit::renderer(Subject subject, Progress* progress) {
  return [this, subject = std::move(subject), progress](const Vector& x, const Capture& photo,
                                                        int spp, std::uint64_t seed,
                                                        std::optional<Differences> which) {
    // Search and verification take Gauss-Newton steps whatever the iterations do.
    if (which)
      return derivatives(subject, x, photo, spp, seed, Purpose::kInstrument, *which, progress);
    const Scene scene = subject.scene_at(x);
    Film film = settings_.renderer(scene, scene.camera(photo.camera), SlotLayout(),
                                   render_settings(photo, spp, seed), progress);
    count(film, photo);
    return film;
  };
}

void Fit::begin_search(const OptimiserKind& kind, const std::vector<UnknownParameter>& wanted) {
  if (settings_.search == "off") return;
  if (in_turns_)
    even_ = EvenFields::of(scene_, wanted, fields_, captures_, loss_, settings_.iterations);
  const bool few = fields_.empty() ? unknowns_.size() <= kFewUnknowns : even_ != nullptr;
  if (settings_.search == "auto" && !(kind.few_unknowns && few)) return;
  if (!few)
    throw InvalidArgument(
        "search = 'on' is for up to " + std::to_string(kFewUnknowns) +
        " unknowns, where an albedo grid or image that starts with one colour "
        "counts as three and any other as too many; choose search = 'off' or 'auto'");
  search_ = std::make_unique<Search>(even_ ? even_->problem() : problem_,
                                     stream_seed(settings_.seed, Stream::kSearch, 0, 0));
  result_.phase = Phase::kSearching;
}

bool Fit::search(Progress* progress) {
  const Subject about =
      even_ ? Subject{even_->problem(), coordinates_ ? &even_->coordinates() : nullptr,
                      [this](const Vector& x) { return even_->scene_at(x); }}
            : subject(field_values_);
  const bool more = search_->step(renderer(about, progress));
  result_.phase_fraction = search_->fraction();
  if (too_many_dropped()) return false;
  if (more) return true;
  x_ = search_->values();
  result_.search = search_->result();
  if (even_) {
    field_values_ = even_->fields(x_);
    result_.fields_last = result_.fields_best = std::make_shared<FieldValues>(field_values_);
    x_ = even_->scalars(x_);
    searched_ = true;
    if (settings_.accumulate) field_newton_ = FieldNewton::of(fields_, captures_);
    if (field_newton_) field_newton_->stand_at(field_values_);
  } else {
    others_ = search_->others();
  }
  search_.reset();
  result_.last = result_.best = x_;
  result_.phase = Phase::kFitting;
  return true;
}

bool Fit::wants_verification() const {
  if (settings_.verification != "auto") return settings_.verification == "on";
  return (fields_.empty() || field_newton_) && unknowns_.size() <= kFewUnknowns &&
         loss_.least_squares &&
         choose_optimiser("auto", unknowns_.size(), loss_, settings_.spp, settings_.accumulate)
             .few_unknowns;
}

/// Beside fields nothing tells a sharp body from a sharper one, but lamps that are seen in it are found
/// the less often.
void Fit::start_verification() {
  Vector x = result_.best;
  if (field_newton_) {
    field_values_ = *result_.fields_best;
    field_newton_->stand_at(field_values_);
    for (int k = 0; k < unknowns_.size(); ++k)
      if (unknowns_.description_of(k).coordinate == Coordinate::kBlur)
        x[k] = std::max(x[k], kSharpRoughness);
    x = unknowns_.project(x);
  }
  verify_from(x, optimiser_.get());
}

void Fit::verify_from(const Vector& x, const Optimiser* optimiser) {
  int spp = settings_.chosen_verification_spp();
  if (field_newton_ && settings_.verification_spp == 0)
    spp /= 5;  // the others are for the few pixels in focus
  verification_ = std::make_unique<Verification>(
      problem_, optimiser, x,
      stream_seed(settings_.seed, Stream::kVerification, verified_rivals_, 0), spp, settings_.spp,
      field_newton_.get());
  result_.phase = Phase::kVerifying;
  note_verified(0);
}

/// Share of this look; those before took as long.
void Fit::note_verified(double fraction) {
  result_.phase_fraction = (verified_rivals_ + fraction) / (verified_rivals_ + 1);
}

bool Fit::verify(Progress* progress) {
  const bool more = verification_->step(renderer(subject(field_values_), progress));
  note_verified(verification_->fraction() * kBeforeRivals);
  if (field_newton_) {
    field_values_ = field_newton_->values();
    result_.fields_last = std::make_shared<FieldValues>(field_values_);
  }
  if (too_many_dropped()) return false;
  if (more) return true;
  std::vector<Vector> rivals;
  verified_.x = verification_->values();
  if (answer_) {
    rivals = serious_;
    rivals.push_back(answer_->x);
  } else {
    // Where the validation finds its values worse, the linear step to them went too far.
    if (!settle(verified_.x, validate(verified_.x, field_values_, progress)))
      verification_->settle_for(result_.best);
    verified_.x = result_.best;
    result_.report = verification_->report();
    rivals = unknowns_.exchanged(result_.best);
    rivals.insert(rivals.end(), others_.begin(), others_.end());
  }
  verified_.report = verification_->report();
  // Those beside fields would need fields of their own.
  if (rivals.empty() || field_newton_) {
    note_verified(1);
    return stop_after_iterations();
  }
  rivals_ =
      std::make_unique<Rivals>(problem_, verification_->weights(), verified_.x, std::move(rivals),
                               stream_seed(settings_.seed, Stream::kRivals, verified_rivals_, 0),
                               settings_.chosen_verification_spp());
  return true;
}

bool Fit::compare_with_rivals(Progress* progress) {
  const bool more = rivals_->step(renderer(subject(field_values_), progress));
  note_verified(kBeforeRivals + (1 - kBeforeRivals) * rivals_->fraction());
  if (too_many_dropped()) return false;
  if (more) return true;
  decide();
  rivals_.reset();
  if (answer_->x != result_.best)
    settle(answer_->x, validate(answer_->x, field_values_, progress), true);
  report_rivals();
  if (serious_.empty() || verified_rivals_ == kMostRivals) return stop_after_iterations();
  // At the bottom of its basin it may win or lose. Instruments of other values say little about it.
  ++verified_rivals_;
  verify_from(serious_.front(), nullptr);
  serious_.erase(serious_.begin());
  return true;
}

/// Between what has just been verified and the answer so far, if there is another.
void Fit::decide() {
  const auto is_answer = [&](const Rivals::Standing& one) {
    return answer_ && one.x == answer_->x;
  };
  std::vector<Rivals::Standing> rest = rivals_->serious(verified_.report);
  std::erase_if(rest, is_answer);
  for (const Rivals::Standing& former : rivals_->standing()) {
    if (!is_answer(former)) continue;
    if (!former.won()) as_good_.push_back(former.ahead > 0 ? verified_ : *answer_);
    if (former.ahead > 0) return;
  }
  serious_.clear();
  for (const Rivals::Standing& one : rest) serious_.push_back(one.x);
  answer_ = verified_;
}

void Fit::report_rivals() {
  result_.report = answer_->report;
  const Coordinates coordinates(unknowns_);
  for (const Vector& x : serious_) contest(result_.report, coordinates, answer_->x, x, false);
  for (const Verified& one : as_good_)
    contest(result_.report, coordinates, answer_->x, one.x, true);
  for (const Verified& one : as_good_) widen(result_.report, one.report);
}

bool Fit::stop_after_iterations() {
  return stop(result_.iterations < all_iterations() ? StopReason::kArrived
                                                    : StopReason::kIterations);
}

}  // namespace selenite
