// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/verification.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/beside.h"
#include "fit/field_newton.h"
#include "fit/streams.h"

namespace selenite {
namespace {

/// Beside fields each pass costs as much as all before it, and the last one is not worth that.
constexpr int kMostPasses = 4, kMostPassesBesideFields = 3;
constexpr double kSurprise = 3;  ///< standard deviations: the answer was not there yet
/// Share of the longest step within which a linear step is as good as a look from its end.
constexpr double kNear = 0.1;
constexpr int kWarmUp = 100, kBeside = 200;  ///< purposes of seeds
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
/// Beside fields, where the last pass has derivatives of its own as well.
constexpr int kDerivativeShareBesideFields = 8;
constexpr int kWarmUps = 2;             ///< pictures that gather instruments where the fit has none
constexpr int kLeastOfDerivatives = 2;  ///< samples: of two, each half has one
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
      fields_(fields) {}

/// Of the residuals; the next one is that of the derivatives.
int Verification::purpose() const { return 2 * report_.passes + (answer_ ? kBeside : 0); }

int Verification::pass_spp(int pass) const {
  const auto index = static_cast<std::size_t>(pass);
  const int share = answer_ ? kShareBeside : index < kShares.size() ? kShares[index] : 1;
  return std::min(spp_, std::max(spp_ / share, kLeastOfPass));
}

Observation Verification::derivatives(int purpose, int turn, int spp, std::size_t capture,
                                      const RenderAt& render) const {
  const int photo = static_cast<int>(capture);
  return {photo,
          render(x_, problem_->captures[capture], spp,
                 seed_of(seed_of(seed_, purpose, photo), turn, photo),
                 Differences{side_in_turn(turn), Side::kBoth}),
          {}};
}

/// Steps of its own are not taken: only what they have seen counts.
void Verification::gather_instruments(const RenderAt& render) {
  iteration_spp_ = std::max(pass_spp(report_.passes) / kDerivativeShare, kLeastOfDerivatives);
  for (int turn = 0; turn < kWarmUps; ++turn) {
    std::vector<Observation> seen;
    for (std::size_t v = 0; v < problem_->captures.size(); ++v)
      seen.push_back(derivatives(kWarmUp, turn, iteration_spp_, v, render));
    (void)evidence_.step(x_, seen);
  }
  has_instruments_ = true;
}

void Verification::gather(int spp, const RenderAt& render) {
  const int share = fields_ ? kDerivativeShareBesideFields : kDerivativeShare;
  const int of_turn = std::max(spp / (share * kTurns), kLeastOfDerivatives);
  for (int turn = 0; turn < kTurns; ++turn)
    evidence_.gather(x_, derivatives(purpose() + 1, turn, of_turn, capture_, render),
                     static_cast<double>(of_turn) / iteration_spp_);
}

bool Verification::step(const RenderAt& render) {
  if (over_) return false;
  if (!has_instruments_) gather_instruments(render);
  const std::size_t captures = problem_->captures.size();
  const Capture& photo = problem_->captures[capture_];
  const int spp = pass_spp(report_.passes);
  Film film =
      render(x_, photo, spp, seed_of(seed_, purpose(), static_cast<int>(capture_)), std::nullopt);
  // The last that may follow has as many samples as the one before, and is near: slopes are known.
  if (answer_ || from_beside_ || report_.passes + 1 < kMostPasses) gather(spp, render);
  if (fields_)
    films_.push_back(std::move(film));
  else
    found_.add(photo, evidence_.equations(capture_, film), captures);
  if (++capture_ < captures) return true;
  if (fields_) {
    // What voxels can imitate is known when all photos have been seen. How sharp a sharp body is shows
    // in little else than in what voxels may be wrong about.
    const std::vector<GaussNewton::Equations> told = evidence_.equations(films_, *fields_);
    for (std::size_t i = 0; i < captures; ++i) found_.add(problem_->captures[i], told[i], captures);
    films_.clear();
    for (int k = 0; k < x_.size(); ++k)
      if (problem_->unknowns.description_of(k).coordinate == Coordinate::kBlur &&
          x_[k] < kSharpRoughness + kRounding)
        found_.leave_out(k);
  }
  if (answer_)
    end_beside();
  else
    end_pass();
  return !over_;
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
  over_ = (whole && there) || report_.passes >= (fields_ ? kMostPassesBesideFields : kMostPasses);
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
  const double part =
      static_cast<double>(capture_) / static_cast<double>(problem_->captures.size());
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
