// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/field_refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "fit/evaluate/seeds.h"
#include "fit/phases/refinement.h"
#include "math/scalar.h"

namespace selenite {
namespace {

constexpr int kWarmUp = 100, kInformative = 300;  ///< purposes of seeds
constexpr RefinementOptions kWithoutFields;       ///< for instruments that are gathered anew
constexpr double kRounding = 1e-9;

}  // namespace

FieldRefinement::FieldRefinement(const Problem& problem, std::unique_ptr<GaussNewton> optimiser,
                                 Vector x, FieldGaussNewton fields, std::uint64_t seed, int spp,
                                 int iteration_spp, FieldRefinementOptions options)
    : options_(options),
      has_jacobians_(optimiser != nullptr),
      point_(problem, std::move(optimiser), std::move(x)),
      fields_(std::move(fields)),
      seed_(seed),
      spp_(spp),
      iteration_spp_(iteration_spp),
      informative_(problem) {
  point_.others.beyond_noise = options_.beyond_noise;
}

int FieldRefinement::pass_spp(int pass) const {
  const std::size_t last = shares().size() - 1;
  const int share = shares()[std::min(static_cast<std::size_t>(pass), last)];
  return std::min(spp_, std::max(spp_ / share, options_.least_of_pass));
}

bool FieldRefinement::is_left_out(int k) const {
  return point_.is_roughness(k) &&
         (options_.roughness_known ||
          (!fields_.has_images() &&
           point_.x[k] < ReparametrizationOptions{}.low_roughness + kRounding));
}

/// Differences are taken from both sides at once, as nothing else needs the picture between them, and
/// whole: the mean of two halves of twice the length is no slope where the lamps seen move by less.
Observation FieldRefinement::derivatives(Evaluator& evaluator, int purpose, int portion, int spp,
                                         std::size_t photo_index, const Photo& photo) const {
  const int index = static_cast<int>(photo_index);
  bool roughnesses = false;
  for (int k = 0; k < point_.x.size(); ++k)
    roughnesses = roughnesses || (point_.is_roughness(k) && !is_left_out(k));
  const Differences which = differences_of_field_refinement(roughnesses);
  const std::uint64_t seed = seed_of(seed_of(seed_, purpose, index), portion, index);
  return {index, evaluator.evaluate({point_.x, fields_.values()}, photo, {spp, seed, which}), {}};
}

void FieldRefinement::gather_first_jacobians(Evaluator& evaluator) {
  iteration_spp_ = std::max(pass_spp(point_.report.passes) / kWithoutFields.derivative_share,
                            kLeastOfDerivatives);
  const std::vector<Photo>& photos = point_.problem->photos;
  for (int portion = 0; portion < kWithoutFields.warm_ups; ++portion) {
    for (std::size_t v = 0; v < photos.size(); ++v)
      point_.gather(derivatives(evaluator, kWarmUp, portion, iteration_spp_, v, photos[v]), 1);
  }
  has_jacobians_ = true;
}

void FieldRefinement::gather(Evaluator& evaluator, int spp) {
  const int samples =
      point_.report.passes == 0 ? spp * options_.pilot : spp / options_.share_after_pilot;
  const int of_portion = std::max(samples / kJacobianPortions, kLeastOfDerivatives);
  for (int portion = 0; portion < kJacobianPortions; ++portion) {
    const Observation seen = derivatives(evaluator, purpose() + 1, portion, of_portion, photo_,
                                         point_.problem->photos[photo_]);
    const double weight = static_cast<double>(of_portion) / iteration_spp_;
    point_.gather(seen, weight);
    informative_.add_pilot(seen, point_.reparametrization().slope(point_.x), weight);
  }
}

bool FieldRefinement::step(Evaluator& evaluator) {
  if (over_) return false;
  const std::vector<Photo>& photos = point_.problem->photos;
  if (!informative_.empty() && photo_ >= photos.size()) return measure_informative(evaluator);
  if (!has_jacobians_) gather_first_jacobians(evaluator);
  const int spp = pass_spp(point_.report.passes);
  const Film film = evaluator.evaluate({point_.x, fields_.values()}, photos[photo_],
                                       {spp, seed_of(seed_, purpose(), static_cast<int>(photo_))});
  gather(evaluator, spp);
  photo_equations_.push_back(point_.gauss_newton.equations(photo_, film));
  if (++photo_ < photos.size()) return true;
  select_informative();
  if (!informative_.empty()) return true;
  end_pass();
  return !over_;
}

void FieldRefinement::select_informative() {
  std::vector<bool> counts;
  for (int k = 0; k < point_.x.size(); ++k) counts.push_back(!is_left_out(k));
  informative_.choose(point_.gauss_newton, counts);
}

bool FieldRefinement::measure_informative(Evaluator& evaluator) {
  const std::size_t i = photo_ - photo_equations_.size();
  const Photo& photo = informative_.photo(i);
  const int spp = options_.informative_samples * pass_spp(point_.report.passes);
  const int of_portion = spp / (options_.informative_derivative_share * kJacobianPortions);
  for (int portion = 0; portion < kJacobianPortions; ++portion)
    informative_.gather(
        derivatives(evaluator, purpose() + kInformative + 1, portion, of_portion, i, photo),
        point_.reparametrization().slope(point_.x));
  const std::uint64_t seed = seed_of(seed_, purpose() + kInformative, static_cast<int>(i));
  const Film film = evaluator.evaluate({point_.x, fields_.values()}, photo, {spp, seed});
  photo_equations_[i].informative = informative_.seen(i, film, point_.gauss_newton);
  if (++photo_ < 2 * photo_equations_.size()) return true;
  informative_.weigh(photo_equations_);
  end_pass();
  return !over_;
}

/// What voxels can make up for is known when all photos have been seen.
void FieldRefinement::end_pass() {
  const std::vector<Photo>& photos = point_.problem->photos;
  const double done = fields_.has_images() ? 1 : point_.gauss_newton.done();
  point_.equations.score_covariance +=
      JointGaussNewton::eliminate_fields(photo_equations_, fields_, done, residuals_kept_);
  for (std::size_t i = 0; i < photo_equations_.size(); ++i)
    point_.equations.add(photos[i], photo_equations_[i]);
  photo_equations_.clear();
  for (int k = 0; k < point_.x.size(); ++k)
    if (is_left_out(k)) point_.equations.remove(k);
  const Vector before = std::exchange(point_.u, point_.reparametrization().from_values(point_.x));
  if (point_.report.passes > 0) point_.others.previous_step = point_.u - before;
  Estimate now = point_.end_pass();
  const int passes = point_.report.passes;
  const double noise =
      passes > 1 ? std::sqrt(1 + static_cast<double>(pass_spp(passes - 1)) / pass_spp(passes - 2))
                 : 1;
  const bool near =
      point_.reach_of(now) <= options_.near && now.surprise <= options_.converged_sigmas * noise;
  over_ = passes >= std::ssize(shares()) &&
          (near || !fields_.has_images() || passes >= options_.most_passes_with_texels);
  if (over_ && near) {
    // Where this pass began is what the one before found: both count, by their samples.
    point_.equations.gradient *= 1 - 1 / (noise * noise);
    now = point_.estimate_here();
  }
  fields_.advance(point_.apply(now));
  if (fields_.has_images())
    residuals_kept_ = std::exp(-square(point_.reach_of(now) / options_.forget_at)) *
                      pass_spp(passes - 1) / pass_spp(passes);
  if (over_) {
    if (!near && now.surprise > options_.converged_sigmas) point_.widen(now.step, point_.x);
    return;
  }
  point_.begin_pass();
  photo_ = 0;
}

double FieldRefinement::fraction() const {
  if (over_) return 1;
  // Each photo is rendered twice in a pass.
  const double part =
      static_cast<double>(photo_) / 2.0 / static_cast<double>(point_.problem->photos.size());
  double done = pass_spp(point_.report.passes) * part, all = 0;
  const int passes = std::max(static_cast<int>(shares().size()), point_.report.passes + 1);
  for (int pass = 0; pass < passes; ++pass) {
    all += pass_spp(pass);
    if (pass < point_.report.passes) done += pass_spp(pass);
  }
  return done / all;
}

void FieldRefinement::members(SavedState& state) {
  state(point_, fields_, has_jacobians_, photo_, seed_, spp_, iteration_spp_, photo_equations_,
        informative_, options_.roughness_known, over_, residuals_kept_);
}

}  // namespace selenite
