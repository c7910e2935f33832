// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "fit/evaluate/seeds.h"
#include "fit/inference/asked_precision.h"
#include "fit/inference/offset_expansion.h"

namespace selenite {
namespace {

constexpr int kWarmUp = 100, kOffset = 200;  ///< purposes of seeds
/// The first passes take shares of the samples, unless those are too few to step by.
constexpr std::array kShares{kFirstShare, kSecondShare};

}  // namespace

Refinement::Refinement(const Problem& problem, std::unique_ptr<GaussNewton> optimiser, Point point,
                       std::uint64_t seed, int spp, int iteration_spp, RefinementOptions options)
    : options_(options),
      has_jacobians_(optimiser != nullptr),
      point_(problem, std::move(optimiser), std::move(point.scalars)),
      fields_(std::move(point.fields)),
      seed_(seed),
      spp_(spp),
      iteration_spp_(iteration_spp) {
  spps_.push_back(pass_spp(0));
}

void Refinement::hold(const std::vector<AbsentWeight>& absent) {
  point_.fixed.resize(absent.empty() ? 0 : static_cast<std::size_t>(point_.x.size()));
  for (const auto& [component, confidence] : absent)
    point_.fixed[static_cast<std::size_t>(component)] = Known{0, confidence};
}

/// Of the seeds of residuals; the next one is that of the derivatives.
int Refinement::purpose() const { return 2 * point_.report.passes + (suspended_ ? kOffset : 0); }

int Refinement::pass_spp(int pass) const {
  const auto index = static_cast<std::size_t>(pass);
  if (!suspended_ && index < spps_.size()) return spps_[index];
  const int share = suspended_               ? options_.offset_share
                    : index < kShares.size() ? kShares[index]
                                             : 1;
  return std::min(spp_, std::max(spp_ / share, options_.least_of_pass));
}

double Refinement::wanted_samples(const Estimate& now) const {
  if (options_.precision == 0) return std::numeric_limits<double>::infinity();
  const Unknowns& unknowns = point_.problem->unknowns;
  const Vector to = unknowns.project(point_.reparametrization().to_values(point_.u + now.step));
  const double most = options_.hope * spp_ / pass_spp(point_.report.passes - 1);
  double wanted = 0;
  for (const double factor : samples_factors(unknowns, to, now.components, options_.precision))
    if (factor <= most) wanted = std::max(wanted, factor);
  return wanted;
}

Evaluation Refinement::of_derivatives(int purpose, int portion, int spp, std::size_t photo) const {
  const int index = static_cast<int>(photo);
  const Differences which = differences_of_refinement(portion);
  return {spp, seed_of(seed_of(seed_, purpose, index), portion, index), which};
}

Observation Refinement::derivatives(Evaluator& evaluator, int purpose, int portion, int spp,
                                    std::size_t photo) const {
  return {static_cast<int>(photo),
          evaluator.evaluate({point_.x, fields_}, point_.problem->photos[photo],
                             of_derivatives(purpose, portion, spp, photo)),
          {}};
}

Evaluation Refinement::of_residual(int spp, std::size_t photo) const {
  return {spp, seed_of(seed_, purpose(), static_cast<int>(photo))};
}

int Refinement::portion_spp(int spp) const {
  return std::max(spp / options_.derivative_share / kJacobianPortions, kLeastOfDerivatives);
}

/// The last that may follow has as many samples as the one before, and is near: slopes are known.
bool Refinement::gathers() const {
  return suspended_ || after_offset_ || point_.report.passes + 1 < options_.most_passes;
}

/// The pictures of photos to come, as `step` will ask for them.
void Refinement::expect(Evaluator& evaluator, int spp) {
  const std::size_t of_photo = gathers() ? 1 + kJacobianPortions : 1;
  const std::vector<Photo>& photos = point_.problem->photos;
  ahead_.reach(evaluator, photo_ * of_photo, photos.size() * of_photo, [&](std::size_t picture) {
    const std::size_t photo = picture / of_photo;
    const int portion = static_cast<int>(picture % of_photo) - 1;
    evaluator.expect({point_.x, fields_}, photos[photo],
                     portion < 0 ? of_residual(spp, photo)
                                 : of_derivatives(purpose() + 1, portion, portion_spp(spp), photo));
  });
}

void Refinement::gather_first_jacobians(Evaluator& evaluator) {
  iteration_spp_ =
      std::max(pass_spp(point_.report.passes) / options_.derivative_share, kLeastOfDerivatives);
  const std::vector<Photo>& photos = point_.problem->photos;
  const std::size_t all = photos.size() * static_cast<std::size_t>(options_.warm_ups);
  const auto portion_of = [&](std::size_t i) { return static_cast<int>(i / photos.size()); };
  Ahead ahead;
  for (std::size_t i = 0; i < all; ++i) {
    ahead.reach(evaluator, i, all, [&](std::size_t k) {
      const std::size_t photo = k % photos.size();
      evaluator.expect({point_.x, fields_}, photos[photo],
                       of_derivatives(kWarmUp, portion_of(k), iteration_spp_, photo));
    });
    point_.gather(derivatives(evaluator, kWarmUp, portion_of(i), iteration_spp_, i % photos.size()),
                  1);
  }
  has_jacobians_ = true;
}

void Refinement::gather(Evaluator& evaluator, int spp) {
  const int of_portion = portion_spp(spp);
  for (int portion = 0; portion < kJacobianPortions; ++portion) {
    const Observation seen = derivatives(evaluator, purpose() + 1, portion, of_portion, photo_);
    point_.gather(seen, static_cast<double>(of_portion) / iteration_spp_);
  }
}

bool Refinement::step(Evaluator& evaluator) {
  if (over_) return false;
  if (!has_jacobians_) gather_first_jacobians(evaluator);
  const std::size_t photos = point_.problem->photos.size();
  const Photo& photo = point_.problem->photos[photo_];
  const int spp = pass_spp(point_.report.passes);
  expect(evaluator, spp);
  const Film film = evaluator.evaluate({point_.x, fields_}, photo, of_residual(spp, photo_));
  if (gathers()) gather(evaluator, spp);
  const GaussNewton::PhotoEquations seen = point_.gauss_newton.equations(photo_, film);
  point_.equations.add(photo, seen);
  point_.gauss_newton.gather_picture(photo_, seen.whole.residual,
                                     static_cast<double>(spp) / iteration_spp_);
  if (++photo_ < photos) return true;
  ahead_ = {};
  if (suspended_)
    end_offset();
  else
    end_pass();
  return !over_;
}

void Refinement::end_pass() {
  const Vector before = std::exchange(point_.u, point_.reparametrization().from_values(point_.x));
  if (point_.report.passes > 0 && !after_offset_) point_.others.previous_step = point_.u - before;
  Estimate now = point_.end_pass();
  const int passes = point_.report.passes;
  const double noise = noise_of_step();
  const int spp = pass_spp(passes - 1);
  const double wanted = wanted_samples(now);
  const bool whole = passes > 1 && (spp == spp_ || wanted <= 1);
  const bool near =
      point_.reach_of(now) <= options_.near && now.surprise <= options_.converged_sigmas * noise;
  const bool there = near || now.surprise <= options_.converged_sigmas;
  over_ = (whole && there) || passes >= options_.most_passes;
  if (over_ && near && !after_offset_) {
    // Where this pass began is what the one before found: both count, by their samples.
    point_.equations.gradient *= 1 - 1 / (noise * noise);
    now = point_.estimate_here();
  }
  point_.report.spp = spp;
  point_.apply(now);
  if (over_) {
    if (!there) point_.widen(now.step, point_.x);
    if (after_offset_) return;
    if (const auto to = point_.offset_of_free()) expand_at_offset(*to);
    return;
  }
  spps_.push_back(pass_spp(passes));
  if (std::isfinite(wanted) && passes >= static_cast<int>(kShares.size())) {
    const double enough = spp * std::max(options_.margin * wanted, 1.0);
    spps_.back() = static_cast<int>(std::min<double>(spp_, std::ceil(enough)));
  }
  point_.begin_pass();
  photo_ = 0;
}

void Refinement::expand_at_offset(const Vector& x) {
  over_ = false;
  suspended_ = {std::exchange(point_.gauss_newton, GaussNewton(*point_.problem)),
                std::exchange(point_.equations, NormalEquations(x.size())), point_.u,
                std::exchange(point_.x, x)};
  has_jacobians_ = false;
  photo_ = 0;
}

void Refinement::end_offset() {
  const Unknowns& unknowns = point_.problem->unknowns;
  const Reparametrization& reparametrization = point_.reparametrization();
  const Vector u = reparametrization.from_values(point_.x);
  OtherPasses moved;
  for (Eigen::Index k = 0; k < u.size(); ++k)
    moved.squared.push_back(point_.x[k] != suspended_->x[k]);
  const Estimate seen =
      estimate(unknowns, reparametrization, u, point_.equations, point_.with_fixed(moved));
  point_.others.known = known_from_offset(
      suspended_->x, point_.report.components, point_.x,
      unknowns.project(reparametrization.to_values(u + seen.step)), seen.components);
  const bool elsewhere = excludes(point_.others.known, suspended_->x);
  if (!elsewhere) point_.gauss_newton = std::move(suspended_->gauss_newton);
  point_.equations = std::move(suspended_->equations);
  point_.u = suspended_->u;
  point_.x = suspended_->x;
  suspended_.reset();
  over_ = !elsewhere;
  if (std::ranges::any_of(point_.others.known, [](const auto& one) { return one.has_value(); }))
    point_.apply(point_.estimate_here());
  if (elsewhere) refine_after_offset();
}

/// What the pass at an offset says of the way is linear, and those before know nothing of its end: their
/// slopes may be of the other sign. Its instruments go on.
void Refinement::refine_after_offset() {
  after_offset_ = true;
  spps_.push_back(pass_spp(point_.report.passes));
  point_.others = {};
  point_.begin_pass();
  photo_ = 0;
}

/// Standard deviation of the last step where all of it is noise, over that of its own pass: the pass
/// before had fewer samples, and where it led has their noise.
double Refinement::noise_of_step() const {
  const int passes = point_.report.passes;
  const double now = pass_spp(passes - 1);
  return passes > 1 ? std::sqrt(1 + now / pass_spp(passes - 2)) : 1;
}

std::vector<Eigen::VectorXf> Refinement::weights() const {
  std::vector<Eigen::VectorXf> all;
  for (std::size_t i = 0; i < point_.problem->photos.size(); ++i)
    all.push_back(point_.gauss_newton.weights()[i]);
  return all;
}

double Refinement::fraction() const {
  // Whether there is a pass at an offset is not known before.
  if (over_ || suspended_ || after_offset_) return 1;
  const double part =
      static_cast<double>(photo_) / static_cast<double>(point_.problem->photos.size());
  // One more than those with a share is the last, mostly.
  const int passes = std::max(point_.report.passes, static_cast<int>(kShares.size())) + 1;
  double done = pass_spp(point_.report.passes) * part, all = 0;
  for (int pass = 0; pass < passes; ++pass) {
    all += pass_spp(pass);
    if (pass < point_.report.passes) done += pass_spp(pass);
  }
  return done / all;
}

void Refinement::members(SavedState& state) {
  state(point_, fields_, has_jacobians_, photo_, seed_, spp_, iteration_spp_, spps_, over_,
        after_offset_);
  bool suspended = suspended_.has_value();
  state(suspended);
  if (!suspended) return;
  if (state.reading()) suspended_ = {GaussNewton(*point_.problem), NormalEquations(0), {}, {}};
  state(*suspended_);
}

}  // namespace selenite
