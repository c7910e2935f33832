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
constexpr int kWarmUp = 100, kOffset = 200, kInformative = 300;  ///< purposes of seeds
/// Derivatives of a look are taken in so many portions, with differences from above and from below in
/// turns: together they are central, at one more picture where both sides at once cost two. The sums of
/// instruments keep two parts, and each of them is to hold both sides.
constexpr int kPortions = 4;
/// The first passes take shares of the samples, unless that are too few to step by.
constexpr std::array kShares{16, 4};
constexpr int kLeastOfPass = 32;
constexpr int kShareBeside = 4;  ///< for a look from beside the answer, with its own instruments
/// Of the samples of residuals. The Jacobians of the iterations serve on, but where unknowns nearly
/// make up for each other their noise hides that: with an eighth, intervals there are too narrow. What
/// a third was worth: docs/measurements/constants.md, "RefinementOptions".
constexpr int kDerivativeShare = 4;
constexpr int kWarmUps = 2;             ///< pictures that gather instruments where the fit has none
constexpr int kLeastOfDerivatives = 2;  ///< samples: of two, each half has one
// Beside fields: shares of the samples that the passes take, of which there are always as many.
constexpr std::array kSharesWithFields{4, 2, 1};
/// Samples of the first pass's derivatives in units of its own, as they tell what to focus on, and the
/// share that those of the others are.
constexpr int kPilot = 2, kShareAfterPilot = 6;
/// Samples of a pixel in focus, in units of the whole picture's, and the share with derivatives: these
/// are the instruments there.
constexpr int kInformativeSamples = 20, kInformativeDerivativeShare = 5;
/// Beside voxels errors are larger than noise, and the linear share of what hardly shows, explain: twenty
/// fits from different random numbers scatter by so much more. Measured:
/// docs/measurements/intervals.md, "Beside voxels".
constexpr double kErrorWithFields = 1.5;
constexpr double kMisfitSigmas = 3;
constexpr double kRounding = 1e-9;

}  // namespace

Refinement::Refinement(const Problem& problem, const Optimiser* optimiser, Vector x,
                           std::uint64_t seed, int spp, int iteration_spp, FieldGaussNewton* fields)
    : problem_(&problem),
      gauss_newton_(dynamic_cast<const GaussNewton*>(optimiser)
                    ? dynamic_cast<const GaussNewton&>(*optimiser)
                    : GaussNewton(problem)),
      has_jacobians_(dynamic_cast<const GaussNewton*>(optimiser) != nullptr),
      found_(x.size()),
      x_(std::move(x)),
      seed_(seed),
      spp_(spp),
      iteration_spp_(iteration_spp),
      fields_(fields),
      informative_(problem) {
  if (fields_) others_.beyond_noise = kErrorWithFields;
}

/// Of the residuals; the next one is that of the derivatives.
int Refinement::purpose() const { return 2 * report_.passes + (suspended_ ? kOffset : 0); }

int Refinement::pass_spp(int pass) const {
  const auto index = static_cast<std::size_t>(pass);
  if (fields_) return std::min(spp_, std::max(spp_ / kSharesWithFields[index], kLeastOfPass));
  const int share = suspended_ ? kShareBeside : index < kShares.size() ? kShares[index] : 1;
  return std::min(spp_, std::max(spp_ / share, kLeastOfPass));
}

/// Beside fields from both sides at once, as nothing else there needs the picture between them, and
/// whole: the mean of two halves of twice the length is no slope where the lamps seen move by less.
Observation Refinement::derivatives(int purpose, int portion, int spp, std::size_t photo_index,
                                      const Photo& photo, const RenderAt& render) const {
  const int index = static_cast<int>(photo_index);
  Differences which{.side = alternating_side(portion), .of_roughness = Side::kBoth};
  if (fields_) {
    which = {.side = Side::kBoth, .of_roughness = Side::kBoth, .roughnesses = false, .picture = false};
    for (int k = 0; k < x_.size(); ++k)
      which.roughnesses = which.roughnesses || (is_roughness(k) && !is_left_out(k));
  }
  const std::uint64_t seed = seed_of(seed_of(seed_, purpose, index), portion, index);
  return {index, render(x_, photo, spp, seed, which), {}};
}

/// Steps of its own are not taken: only what they have seen counts.
void Refinement::gather_first_jacobians(const RenderAt& render) {
  iteration_spp_ = std::max(pass_spp(report_.passes) / kDerivativeShare, kLeastOfDerivatives);
  for (int portion = 0; portion < kWarmUps; ++portion) {
    std::vector<Observation> seen;
    for (std::size_t v = 0; v < problem_->photos.size(); ++v)
      seen.push_back(derivatives(kWarmUp, portion, iteration_spp_, v, problem_->photos[v], render));
    (void)gauss_newton_.step(x_, seen);
  }
  has_jacobians_ = true;
}

void Refinement::gather(int spp, const RenderAt& render) {
  int samples = spp / kDerivativeShare;
  if (fields_) samples = report_.passes == 0 ? spp * kPilot : spp / kShareAfterPilot;
  const int of_portion = std::max(samples / kPortions, kLeastOfDerivatives);
  for (int portion = 0; portion < kPortions; ++portion) {
    const Observation seen =
        derivatives(purpose() + 1, portion, of_portion, photo_, problem_->photos[photo_], render);
    const double weight = static_cast<double>(of_portion) / iteration_spp_;
    gauss_newton_.gather(x_, seen, weight);
    if (fields_) informative_.add_pilot(seen, gauss_newton_.reparametrization().slope(x_), weight);
  }
}

bool Refinement::step(const RenderAt& render) {
  if (over_) return false;
  if (!informative_.empty() && photo_ >= problem_->photos.size()) return measure_informative(render);
  if (!has_jacobians_) gather_first_jacobians(render);
  const std::size_t photos = problem_->photos.size();
  const Photo& photo = problem_->photos[photo_];
  const int spp = pass_spp(report_.passes);
  Film film =
      render(x_, photo, spp, seed_of(seed_, purpose(), static_cast<int>(photo_)), std::nullopt);
  // The last that may follow has as many samples as the one before, and is near: slopes are known.
  if (fields_ || suspended_ || after_offset_ || report_.passes + 1 < kMostPasses) gather(spp, render);
  if (fields_)
    photo_equations_.push_back(gauss_newton_.equations(photo_, film));
  else
    found_.add(photo, gauss_newton_.equations(photo_, film), photos);
  if (++photo_ < photos) return true;
  if (fields_) {
    select_informative();
    if (!informative_.empty()) return true;
    end_with_fields();
  } else if (suspended_) {
    end_offset();
  } else {
    end_pass();
  }
  return !over_;
}

/// How sharp a sharp body is shows in little else than in what voxels may be wrong about.
bool Refinement::is_left_out(int k) const {
  return is_roughness(k) && x_[k] < kLowRoughness + kRounding;
}

bool Refinement::is_roughness(int k) const {
  return problem_->unknowns.description_of(k).scale == Scale::kRoughness;
}

void Refinement::select_informative() {
  std::vector<bool> counts;
  for (int k = 0; k < x_.size(); ++k) counts.push_back(!is_left_out(k));
  informative_.choose(gauss_newton_, counts);
}

bool Refinement::measure_informative(const RenderAt& render) {
  const std::size_t i = photo_ - photo_equations_.size();
  const Photo& photo = informative_.photo(i);
  const int spp = kInformativeSamples * pass_spp(report_.passes);
  for (int portion = 0; portion < kPortions; ++portion)
    informative_.gather(derivatives(purpose() + kInformative + 1, portion, spp / (kInformativeDerivativeShare * kPortions),
                              i, photo, render),
                  gauss_newton_.reparametrization().slope(x_));
  const std::uint64_t seed = seed_of(seed_, purpose() + kInformative, static_cast<int>(i));
  photo_equations_[i].informative = informative_.seen(i, render(x_, photo, spp, seed, std::nullopt), gauss_newton_);
  if (++photo_ < 2 * photo_equations_.size()) return true;
  InformativePixels::weigh(photo_equations_);
  end_with_fields();
  return !over_;
}

/// What voxels can imitate is known when all photos have been seen.
void Refinement::end_with_fields() {
  found_.score_covariance += gauss_newton_.eliminate_fields(photo_equations_, *fields_);
  for (std::size_t i = 0; i < photo_equations_.size(); ++i)
    found_.add(problem_->photos[i], photo_equations_[i], photo_equations_.size());
  photo_equations_.clear();
  for (int k = 0; k < x_.size(); ++k)
    if (is_left_out(k)) found_.remove(k);
  end_pass();
}

void Refinement::end_pass() {
  const Reparametrization& reparametrization = gauss_newton_.reparametrization();
  const Vector before = std::exchange(u_, reparametrization.from_values(x_));
  if (report_.passes > 0 && !after_offset_) others_.previous_step = u_ - before;
  Estimate now = estimate(problem_->unknowns, reparametrization, u_, found_, others_);
  ++report_.passes;
  report_.misfit.value = found_.misfit;
  report_.misfit.standard_error = std::sqrt(found_.misfit_variance);
  report_.misfit.explained = found_.misfit <= kMisfitSigmas * report_.misfit.standard_error;
  const double reach = reach_of(now);
  const double noise = noise_of_step();
  const bool whole = pass_spp(report_.passes - 1) == spp_ && report_.passes > 1;
  const bool near = reach <= kNear && now.surprise <= kSurprise * noise;
  const bool there = near || now.surprise <= kSurprise;
  over_ = fields_ ? report_.passes == std::ssize(kSharesWithFields)
                  : (whole && there) || report_.passes >= kMostPasses;
  if (over_ && near && !after_offset_) {
    // Where this pass began is what the one before found: both count, by their samples.
    found_.gradient *= 1 - 1 / (noise * noise);
    now = estimate(problem_->unknowns, reparametrization, u_, found_, others_);
  }
  apply(now);
  if (over_) {
    if (!there) widen(now.step, x_);
    if (after_offset_ || fields_) return;
    if (const auto to = offset_point(problem_->unknowns, x_)) expand_at_offset(*to);
    return;
  }
  found_ = NormalEquations(x_.size());
  photo_ = 0;
}

/// The longest of its steps, in units of those that may be taken at once.
double Refinement::reach_of(const Estimate& now) const {
  return now.step.cwiseQuotient(gauss_newton_.reparametrization().cap()).cwiseAbs().maxCoeff();
}

void Refinement::apply(const Estimate& now) {
  const Vector step = now.step / std::max(1.0, reach_of(now));
  x_ = problem_->unknowns.project(gauss_newton_.reparametrization().to_values(u_ + step));
  if (fields_) fields_->advance(gauss_newton_.reparametrization().from_values(x_) - u_);
  report_components(now, x_);
}

void Refinement::expand_at_offset(const Vector& x) {
  over_ = false;
  suspended_ = {std::exchange(gauss_newton_, GaussNewton(*problem_)),
             std::exchange(found_, NormalEquations(x.size())), u_, std::exchange(x_, x)};
  has_jacobians_ = false;
  photo_ = 0;
}

void Refinement::end_offset() {
  const Unknowns& unknowns = problem_->unknowns;
  const Reparametrization& reparametrization = gauss_newton_.reparametrization();
  const Vector u = reparametrization.from_values(x_);
  OtherPasses moved;
  for (Eigen::Index k = 0; k < u.size(); ++k) moved.squared.push_back(x_[k] != suspended_->x[k]);
  const Estimate seen = estimate(unknowns, reparametrization, u, found_, moved);
  others_.known =
      known_from_offset(suspended_->x, report_.components, x_,
                 unknowns.project(reparametrization.to_values(u + seen.step)), seen.components);
  const bool elsewhere = excludes(others_.known, suspended_->x);
  if (!elsewhere) gauss_newton_ = std::move(suspended_->gauss_newton);
  found_ = std::move(suspended_->found);
  u_ = suspended_->u;
  x_ = suspended_->x;
  suspended_.reset();
  over_ = !elsewhere;
  if (std::ranges::any_of(others_.known, [](const auto& one) { return one.has_value(); }))
    apply(estimate(unknowns, gauss_newton_.reparametrization(), u_, found_, others_));
  if (elsewhere) refine_after_offset();
}

/// What the look from beside says of the way is linear, and those before know nothing of its end: their
/// slopes may be of the other sign. Its instruments go on.
void Refinement::refine_after_offset() {
  after_offset_ = true;
  others_ = {};
  found_ = NormalEquations(x_.size());
  photo_ = 0;
}

/// Standard deviation of the last step where all of it is noise, over that of its own pass: the pass
/// before had fewer samples, and where it led has their noise.
double Refinement::noise_of_step() const {
  const double now = pass_spp(report_.passes - 1);
  return report_.passes > 1 ? std::sqrt(1 + now / pass_spp(report_.passes - 2)) : 1;
}

void Refinement::accept(const Vector& x) {
  const Reparametrization& reparametrization = gauss_newton_.reparametrization();
  // The intervals are about where the whole step leads, `values` only as far along it as one may go.
  const Vector end = u_ + estimate(problem_->unknowns, reparametrization, u_, found_, others_).step;
  for (std::size_t i = 0; i < others_.known.size(); ++i)
    if (std::optional<Known>& one = others_.known[i]) one->value = x[static_cast<Eigen::Index>(i)];
  widen(end - reparametrization.from_values(x), x);
}

void Refinement::widen(const Vector& way, const Vector& x) {
  others_.unsure_step = way;
  report_components(estimate(problem_->unknowns, gauss_newton_.reparametrization(), u_, found_, others_), x);
}

void Refinement::report_components(const Estimate& now, const Vector& x) {
  report_.components = now.components;
  contain(problem_->unknowns, gauss_newton_.reparametrization(), x, report_.components);
}

std::vector<Eigen::VectorXf> Refinement::weights() const {
  std::vector<Eigen::VectorXf> all;
  for (std::size_t i = 0; i < problem_->photos.size(); ++i) all.push_back(gauss_newton_.weight(i));
  return all;
}

double Refinement::fraction() const {
  // Whether there is a look from beside, nobody knew.
  if (over_ || suspended_ || after_offset_) return 1;
  // Beside fields each photo is looked at twice.
  const double part = static_cast<double>(photo_) / (fields_ ? 2.0 : 1.0) /
                      static_cast<double>(problem_->photos.size());
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
