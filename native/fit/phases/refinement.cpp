// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/inference/offset_expansion.h"
#include "fit/solver/field_gauss_newton.h"
#include "fit/evaluate/seeds.h"

namespace selenite {
namespace {

constexpr int kMostPasses = 4;
constexpr double kSurprise = 3;  ///< standard deviations: the answer was not there yet
/// Share of the longest step within which a linear step is as good as a look from its end.
constexpr double kNear = 0.1;
constexpr int kWarmUp = 100, kBeside = 200, kFocus = 300;  ///< purposes of seeds
/// Derivatives of a look are taken in so many portions, with differences from above and from below in
/// turns: together they are central, at one more picture where both sides at once cost two. The sums of
/// instruments keep two parts, and each of them is to hold both sides.
constexpr int kTurns = 4;
/// The first passes take shares of the samples, unless that are too few to step by.
constexpr std::array kShares{16, 4};
constexpr int kLeastOfPass = 32;
constexpr int kShareBeside = 4;  ///< for a look from beside the answer, with its own instruments
/// Of the samples of residuals. The Jacobians of the iterations serve on, but where unknowns nearly
/// make up for each other their noise hides that: with an eighth, intervals there are too narrow. What
/// a third was worth: manual page "fitting", "Measured".
constexpr int kDerivativeShare = 4;
constexpr int kWarmUps = 2;             ///< pictures that gather instruments where the fit has none
constexpr int kLeastOfDerivatives = 2;  ///< samples: of two, each half has one
// Beside fields: shares of the samples that the passes take, of which there are always as many.
constexpr std::array kSharesBesideFields{4, 2, 1};
/// Samples of the first pass's derivatives in units of its own, as they tell what to focus on, and the
/// share that those of the others are.
constexpr int kScouting = 2, kShareAfterScouting = 6;
/// Samples of a pixel in focus, in units of the whole picture's, and the share with derivatives: these
/// are the instruments there.
constexpr int kFocusSamples = 20, kFocusDerivativeShare = 5;
/// Beside voxels errors are larger than noise, and the linear share of what hardly shows, explain: twenty
/// fits from different random numbers scatter by so much more. Measured: manual page "fitting",
/// "Voxels and scalars together".
constexpr double kErrorBesideFields = 1.5;
constexpr double kMisfitSigmas = 3;
constexpr double kRounding = 1e-9;

}  // namespace

Verification::Verification(const Problem& problem, const Optimiser* optimiser, Vector x,
                           std::uint64_t seed, int spp, int iteration_spp, FieldNewton* fields)
    : problem_(&problem),
      evidence_(dynamic_cast<const GaussNewton*>(optimiser)
                    ? dynamic_cast<const GaussNewton&>(*optimiser)
                    : GaussNewton(problem)),
      has_instruments_(dynamic_cast<const GaussNewton*>(optimiser) != nullptr),
      found_(x.size()),
      x_(std::move(x)),
      seed_(seed),
      spp_(spp),
      iteration_spp_(iteration_spp),
      fields_(fields),
      focus_(problem) {
  if (fields_) others_.beyond_noise = kErrorBesideFields;
}

/// Of the residuals; the next one is that of the derivatives.
int Verification::purpose() const { return 2 * report_.passes + (answer_ ? kBeside : 0); }

int Verification::pass_spp(int pass) const {
  const auto index = static_cast<std::size_t>(pass);
  if (fields_) return std::min(spp_, std::max(spp_ / kSharesBesideFields[index], kLeastOfPass));
  const int share = answer_ ? kShareBeside : index < kShares.size() ? kShares[index] : 1;
  return std::min(spp_, std::max(spp_ / share, kLeastOfPass));
}

/// Beside fields from both sides at once, as nothing else there needs the picture between them, and
/// whole: the mean of two halves of twice the length is no slope where the lamps seen move by less.
Observation Verification::derivatives(int purpose, int turn, int spp, std::size_t capture,
                                      const Capture& photo, const RenderAt& render) const {
  const int index = static_cast<int>(capture);
  Differences which{.side = side_in_turn(turn), .of_roughness = Side::kBoth};
  if (fields_) {
    which = {.side = Side::kBoth, .of_roughness = Side::kBoth, .blurs = false, .picture = false};
    for (int k = 0; k < x_.size(); ++k)
      which.blurs = which.blurs || (is_blur(k) && !is_left_out(k));
  }
  const std::uint64_t seed = seed_of(seed_of(seed_, purpose, index), turn, index);
  return {index, render(x_, photo, spp, seed, which), {}};
}

/// Steps of its own are not taken: only what they have seen counts.
void Verification::gather_instruments(const RenderAt& render) {
  iteration_spp_ = std::max(pass_spp(report_.passes) / kDerivativeShare, kLeastOfDerivatives);
  for (int turn = 0; turn < kWarmUps; ++turn) {
    std::vector<Observation> seen;
    for (std::size_t v = 0; v < problem_->captures.size(); ++v)
      seen.push_back(derivatives(kWarmUp, turn, iteration_spp_, v, problem_->captures[v], render));
    (void)evidence_.step(x_, seen);
  }
  has_instruments_ = true;
}

void Verification::gather(int spp, const RenderAt& render) {
  int samples = spp / kDerivativeShare;
  if (fields_) samples = report_.passes == 0 ? spp * kScouting : spp / kShareAfterScouting;
  const int of_turn = std::max(samples / kTurns, kLeastOfDerivatives);
  for (int turn = 0; turn < kTurns; ++turn) {
    const Observation seen =
        derivatives(purpose() + 1, turn, of_turn, capture_, problem_->captures[capture_], render);
    const double weight = static_cast<double>(of_turn) / iteration_spp_;
    evidence_.gather(x_, seen, weight);
    if (fields_) focus_.scout(seen, evidence_.coordinates().slope(x_), weight);
  }
}

bool Verification::step(const RenderAt& render) {
  if (over_) return false;
  if (!focus_.empty() && capture_ >= problem_->captures.size()) return look_closer(render);
  if (!has_instruments_) gather_instruments(render);
  const std::size_t captures = problem_->captures.size();
  const Capture& photo = problem_->captures[capture_];
  const int spp = pass_spp(report_.passes);
  Film film =
      render(x_, photo, spp, seed_of(seed_, purpose(), static_cast<int>(capture_)), std::nullopt);
  // The last that may follow has as many samples as the one before, and is near: slopes are known.
  if (fields_ || answer_ || from_beside_ || report_.passes + 1 < kMostPasses) gather(spp, render);
  if (fields_)
    told_.push_back(evidence_.equations(capture_, film));
  else
    found_.add(photo, evidence_.equations(capture_, film), captures);
  if (++capture_ < captures) return true;
  if (fields_) {
    choose_focus();
    if (!focus_.empty()) return true;
    end_beside_fields();
  } else if (answer_) {
    end_beside();
  } else {
    end_pass();
  }
  return !over_;
}

/// How sharp a sharp body is shows in little else than in what voxels may be wrong about.
bool Verification::is_left_out(int k) const {
  return is_blur(k) && x_[k] < kSharpRoughness + kRounding;
}

bool Verification::is_blur(int k) const {
  return problem_->unknowns.description_of(k).coordinate == Coordinate::kBlur;
}

void Verification::choose_focus() {
  std::vector<bool> counts;
  for (int k = 0; k < x_.size(); ++k) counts.push_back(!is_left_out(k));
  focus_.choose(evidence_, counts);
}

bool Verification::look_closer(const RenderAt& render) {
  const std::size_t i = capture_ - told_.size();
  const Capture& photo = focus_.photo(i);
  const int spp = kFocusSamples * pass_spp(report_.passes);
  for (int turn = 0; turn < kTurns; ++turn)
    focus_.gather(derivatives(purpose() + kFocus + 1, turn, spp / (kFocusDerivativeShare * kTurns),
                              i, photo, render),
                  evidence_.coordinates().slope(x_));
  const std::uint64_t seed = seed_of(seed_, purpose() + kFocus, static_cast<int>(i));
  told_[i].focus = focus_.seen(i, render(x_, photo, spp, seed, std::nullopt), evidence_);
  if (++capture_ < 2 * told_.size()) return true;
  Focus::weigh(told_);
  end_beside_fields();
  return !over_;
}

/// What voxels can imitate is known when all photos have been seen.
void Verification::end_beside_fields() {
  found_.spread += evidence_.separate(told_, *fields_);
  for (std::size_t i = 0; i < told_.size(); ++i)
    found_.add(problem_->captures[i], told_[i], told_.size());
  told_.clear();
  for (int k = 0; k < x_.size(); ++k)
    if (is_left_out(k)) found_.leave_out(k);
  end_pass();
}

void Verification::end_pass() {
  const Coordinates& coordinates = evidence_.coordinates();
  const Vector before = std::exchange(u_, coordinates.from_values(x_));
  if (report_.passes > 0 && !from_beside_) others_.gone = u_ - before;
  Estimate now = estimate(problem_->unknowns, coordinates, u_, found_, others_);
  ++report_.passes;
  report_.misfit.value = found_.misfit;
  report_.misfit.standard_error = std::sqrt(found_.misfit_variance);
  report_.misfit.explained = found_.misfit <= kMisfitSigmas * report_.misfit.standard_error;
  const double reach = reach_of(now);
  const double noise = noise_of_step();
  const bool whole = pass_spp(report_.passes - 1) == spp_ && report_.passes > 1;
  const bool near = reach <= kNear && now.surprise <= kSurprise * noise;
  const bool there = near || now.surprise <= kSurprise;
  over_ = fields_ ? report_.passes == std::ssize(kSharesBesideFields)
                  : (whole && there) || report_.passes >= kMostPasses;
  if (over_ && near && !from_beside_) {
    // Where this pass began is what the one before found: both count, by their samples.
    found_.gradient *= 1 - 1 / (noise * noise);
    now = estimate(problem_->unknowns, coordinates, u_, found_, others_);
  }
  take(now);
  if (over_) {
    if (!there) widen(now.step, x_);
    if (from_beside_ || fields_) return;
    if (const auto to = beside(problem_->unknowns, x_)) look_beside(*to);
    return;
  }
  found_ = Evidence(x_.size());
  capture_ = 0;
}

/// The longest of its steps, in units of those that may be taken at once.
double Verification::reach_of(const Estimate& now) const {
  return now.step.cwiseQuotient(evidence_.coordinates().cap()).cwiseAbs().maxCoeff();
}

void Verification::take(const Estimate& now) {
  const Vector step = now.step / std::max(1.0, reach_of(now));
  x_ = problem_->unknowns.project(evidence_.coordinates().to_values(u_ + step));
  if (fields_) fields_->advance(evidence_.coordinates().from_values(x_) - u_);
  tell(now, x_);
}

void Verification::look_beside(const Vector& x) {
  over_ = false;
  answer_ = {std::exchange(evidence_, GaussNewton(*problem_)),
             std::exchange(found_, Evidence(x.size())), u_, std::exchange(x_, x)};
  has_instruments_ = false;
  capture_ = 0;
}

void Verification::end_beside() {
  const Unknowns& unknowns = problem_->unknowns;
  const Coordinates& coordinates = evidence_.coordinates();
  const Vector u = coordinates.from_values(x_);
  OtherLooks moved;
  for (Eigen::Index k = 0; k < u.size(); ++k) moved.squared.push_back(x_[k] != answer_->x[k]);
  const Estimate seen = estimate(unknowns, coordinates, u, found_, moved);
  others_.known =
      known_from(answer_->x, report_.components, x_,
                 unknowns.project(coordinates.to_values(u + seen.step)), seen.components);
  const bool elsewhere = leads_elsewhere(others_.known, answer_->x);
  if (!elsewhere) evidence_ = std::move(answer_->evidence);
  found_ = std::move(answer_->found);
  u_ = answer_->u;
  x_ = answer_->x;
  answer_.reset();
  over_ = !elsewhere;
  if (std::ranges::any_of(others_.known, [](const auto& one) { return one.has_value(); }))
    take(estimate(unknowns, evidence_.coordinates(), u_, found_, others_));
  if (elsewhere) look_from_there();
}

/// What the look from beside says of the way is linear, and those before know nothing of its end: their
/// slopes may be of the other sign. Its instruments go on.
void Verification::look_from_there() {
  from_beside_ = true;
  others_ = {};
  found_ = Evidence(x_.size());
  capture_ = 0;
}

/// Standard deviation of the last step where all of it is noise, over that of its own pass: the pass
/// before had fewer samples, and where it led has their noise.
double Verification::noise_of_step() const {
  const double now = pass_spp(report_.passes - 1);
  return report_.passes > 1 ? std::sqrt(1 + now / pass_spp(report_.passes - 2)) : 1;
}

void Verification::settle_for(const Vector& x) {
  const Coordinates& coordinates = evidence_.coordinates();
  // The intervals are about where the whole step leads, `values` only as far along it as one may go.
  const Vector end = u_ + estimate(problem_->unknowns, coordinates, u_, found_, others_).step;
  for (std::size_t i = 0; i < others_.known.size(); ++i)
    if (std::optional<Known>& one = others_.known[i]) one->value = x[static_cast<Eigen::Index>(i)];
  widen(end - coordinates.from_values(x), x);
}

void Verification::widen(const Vector& way, const Vector& x) {
  others_.unsure = way;
  tell(estimate(problem_->unknowns, evidence_.coordinates(), u_, found_, others_), x);
}

void Verification::tell(const Estimate& now, const Vector& x) {
  report_.components = now.components;
  hold(problem_->unknowns, evidence_.coordinates(), x, report_.components);
}

std::vector<Eigen::VectorXf> Verification::weights() const {
  std::vector<Eigen::VectorXf> all;
  for (std::size_t i = 0; i < problem_->captures.size(); ++i) all.push_back(evidence_.weight(i));
  return all;
}

double Verification::fraction() const {
  // Whether there is a look from beside, nobody knew.
  if (over_ || answer_ || from_beside_) return 1;
  // Beside fields each photo is looked at twice.
  const double part = static_cast<double>(capture_) / (fields_ ? 2.0 : 1.0) /
                      static_cast<double>(problem_->captures.size());
  // One more than those with a share is the last, mostly.
  const int passes = std::max(report_.passes, static_cast<int>(kShares.size())) + 1;
  double done = pass_spp(report_.passes) * part, all = 0;
  for (int pass = 0; pass < passes; ++pass) {
    all += pass_spp(pass);
    if (pass < report_.passes) done += pass_spp(pass);
  }
  return done / all;
}

}  // namespace selenite
