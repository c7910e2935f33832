// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit does before its first iteration and after its last.
#include <memory>

#include "fit/fit.h"
#include "fit/streams.h"

namespace selenite {
namespace {

/// Share of a verification that is over when the answer is compared with its rivals.
constexpr double kBeforeRivals = 0.9;

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

RenderAt Fit::renderer(Progress* progress) {
  return [this, progress](const Vector& x, const Capture& photo, int spp, std::uint64_t seed,
                          std::optional<Side> derivatives) {
    const Scene scene = scene_at(x, field_values_);
    const Camera& camera = scene.camera(photo.camera);
    const RenderSettings settings = render_settings(photo, spp, seed);
    if (derivatives) {
      Film film = render_slots(scene, camera, settings, progress);
      // Search and verification take Gauss-Newton steps whatever the iterations do.
      add_secants(x, field_values_, camera, settings, Purpose::kInstrument, *derivatives, film,
                  progress);
      return film;
    }
    Film film = settings_.renderer(scene, camera, SlotLayout(), settings, progress);
    count(film);
    return film;
  };
}

void Fit::add_secants(const Vector& x, const FieldValues& fields, const Camera& camera,
                      const RenderSettings& settings, Purpose purpose, Side side, Film& film,
                      Progress* progress) {
  if (!secants_) return;
  const auto render = [&](const Vector& at) {
    Film other = settings_.renderer(scene_at(at, fields), camera, SlotLayout(), settings, progress);
    count(other);
    return other;
  };
  take_secants(problem_, *secants_, scene_at(x, fields), x, purpose, side, render, film);
}

bool Fit::search(Progress* progress) {
  const bool more = search_->step(renderer(progress));
  result_.phase_fraction = search_->fraction();
  if (too_many_dropped()) return false;
  if (more) return true;
  x_ = result_.last = result_.best = search_->values();
  result_.search = search_->result();
  result_.phase = Phase::kFitting;
  others_ = search_->others();
  search_.reset();
  return true;
}

bool Fit::wants_verification() const {
  if (settings_.verification != "auto") return settings_.verification == "on";
  return fields_.empty() && unknowns_.size() <= kFewUnknowns && loss_.least_squares &&
         choose_optimiser("auto", unknowns_.size(), loss_, settings_.spp, settings_.accumulate)
             .few_unknowns;
}

void Fit::start_verification() {
  verification_ = std::make_unique<Verification>(
      problem_, *optimiser_, result_.best, stream_seed(settings_.seed, Stream::kVerification, 0, 0),
      settings_.chosen_verification_spp(), settings_.spp);
  result_.phase = Phase::kVerifying;
  result_.phase_fraction = 0;
}

bool Fit::verify(Progress* progress) {
  const bool more = verification_->step(renderer(progress));
  result_.phase_fraction = verification_->fraction() * (others_.empty() ? 1 : kBeforeRivals);
  if (too_many_dropped()) return false;
  if (more) return true;
  // Where the validation finds its values worse, the linear step to them went too far.
  if (!settle(verification_->values(), progress)) verification_->settle_for(result_.best);
  result_.report = verification_->report();
  if (others_.empty()) return stop_after_iterations();
  rivals_ = std::make_unique<Rivals>(problem_, verification_->weights(), result_.best, others_,
                                     stream_seed(settings_.seed, Stream::kRivals, 0, 0),
                                     settings_.chosen_verification_spp());
  return true;
}

bool Fit::compare_with_rivals(Progress* progress) {
  const bool more = rivals_->step(renderer(progress));
  result_.phase_fraction = kBeforeRivals + (1 - kBeforeRivals) * rivals_->fraction();
  if (too_many_dropped()) return false;
  if (more) return true;
  rivals_->judge(result_.report);
  return stop_after_iterations();
}

bool Fit::stop_after_iterations() {
  return stop(result_.iterations < settings_.iterations ? StopReason::kArrived
                                                        : StopReason::kIterations);
}

}  // namespace selenite
