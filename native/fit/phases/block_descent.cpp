// SPDX-License-Identifier: GPL-3.0-or-later
// How a fit goes about scalars and fields in turns.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fit/run/fit.h"
#include "fit/evaluate/finite_differences.h"
#include "fit/evaluate/seeds.h"
#include "fit/solver/parabolic_line_search.h"

namespace selenite {
namespace {

/// Iterations of scalars and of fields where they take turns; fewer in a short fit.
constexpr int kScalarBlock = 5, kFieldBlock = 5;
/// After a search: iterations of fields and then of scalars, and tenths of them that scalars have.
constexpr int kCycle = 10, kScalarTenths = 3;
constexpr int kFirstFields = 2;  ///< of voxels together with scalars: Jacobians are needed to begin
/// After a search, the first step of a field and the last one of an image in learning rates, and the
/// pixels of the photos that tell together of a texel.
constexpr double kFirstRate = 4, kLastRate = 0.25;
constexpr double kFirstSpread = 800, kLastSpread = 8;
constexpr double kMostSpread = 1.0 / 80;  ///< of the image
/// Share of the last step in the mean that ends a turn of an image.
constexpr double kNewest = 0.3;
/// In log(IOR - 1): 0.02 at 1.5, where lamps that are seen through a sharp body move by about a pixel
/// of a hundred.
constexpr double kRefractionStep = 0.04;

}  // namespace

/// Without a search the scalars are first: a field starts best at the one value that suits the whole
/// object. After one they are as good as they get while the voxels are alike: the fields are first, and
/// the scalars have the last turn, as they are fitted to the voxels that are found. Where both are
/// stepped together, scalars that are still wrong lead voxels astray: theirs is the first whole turn.
bool Fit::is_scalar_block(int iteration) const {
  const std::int64_t all = all_iterations();
  if (!searched_) {
    const std::int64_t scalars = std::clamp<std::int64_t>(all / 2, 1, kScalarBlock);
    return iteration % (scalars + std::clamp<std::int64_t>(all - scalars, 1, kFieldBlock)) < scalars;
  }
  if (field_gauss_newton_) {
    const std::int64_t first = std::min<std::int64_t>(kFirstFields, all / 5);
    const std::int64_t turn = (kCycle * kScalarTenths + 5) / 10;
    return iteration >= all - turn || (iteration >= first && (iteration - first) % kCycle < turn);
  }
  const std::int64_t cycles = std::max<std::int64_t>(1, (all + kCycle / 2) / kCycle);
  const std::int64_t cycle = ((iteration + 1) * cycles - 1) / all;
  const std::int64_t begin = cycle * all / cycles, end = (cycle + 1) * all / cycles;
  return iteration >= end - std::max<std::int64_t>(1, (kScalarTenths * (end - begin) + 5) / 10);
}

Fit::Block Fit::block(int iteration) const {
  if (!alternates_) return {true, !fields_.empty(), false};
  const bool scalars = is_scalar_block(iteration);
  return {scalars, !scalars, iteration == 0 || is_scalar_block(iteration - 1) != scalars};
}

int Fit::all_iterations() const {
  const bool looks = field_gauss_newton_ && wants_refinement();
  return looks ? (settings_.iterations + 1) / 2 : settings_.iterations;
}

int Fit::count_iterations(bool Block::*member, int iterations) const {
  int count = 0;
  for (int i = 0; i < iterations; ++i) count += block(i).*member;
  return count;
}

/// After a search fields are still alike, have a long way to go and few steps: these begin long and, of
/// images, wide. Those of images end short and narrow, as the noise of texels looks like detail, and a
/// body that is blurred a little then explains the photos better than the right one. Voxels have
/// farther to go.
std::vector<FieldStep> Fit::field_steps() const {
  std::vector<FieldStep> steps(fields_.refs().size());
  if (!searched_) return steps;
  const double done = static_cast<double>(count_iterations(&Block::fields, result_.iterations)) /
                      count_iterations(&Block::fields, settings_.iterations);
  const auto between = [done](double first, double last) { return first + (last - first) * done; };
  double pixels = 0;
  for (const Photo& photo : photos_)
    pixels +=
        static_cast<double>(std::ranges::count_if(photo.weight, [](float w) { return w > 0; }));
  const auto side = [&](double share) { return std::sqrt(std::min(share / pixels, kMostSpread)); };
  const double spread = std::pow(between(side(kFirstSpread), side(kLastSpread)), 2);
  // Each photo makes a step.
  const double share = 1 / std::sqrt(static_cast<double>(photos_.size()));
  for (std::size_t f = 0; f < steps.size(); ++f)
    steps[f] = {share * between(kFirstRate, fields_.image(f) ? kLastRate : 1), spread};
  return steps;
}

/// What noise is left in the steps of texels. Voxels have farther to go and stay as they are.
void Fit::smooth(const Block& now) {
  if (now.first) field_means_ = field_values_;
  const bool ends = block(result_.iterations + 1).scalars;
  for (std::size_t f = 0; f < field_values_.size(); ++f) {
    if (!fields_.image(f)) continue;
    field_means_[f] += kNewest * (field_values_[f] - field_means_[f]);
    if (ends) field_values_[f] = field_means_[f];
  }
}

Vector Fit::at_low_roughness(Vector x) const {
  for (int k = 0; k < unknowns_.size(); ++k)
    if (unknowns_.description_of(k).scale == Scale::kRoughness)
      x[k] = std::min(x[k], kLowRoughness);
  return unknowns_.project(x);
}

bool Fit::is_low_roughness(const Vector& x) const { return at_low_roughness(x) == x; }

/// Within its standard error, and that of their difference: what is wrong about texels and voxels looks
/// like blur, so that of two bodies that are about as good the sharp one is nearer. The noise of a
/// validation alone hides a gloss that pixel against pixel is seen; that of the difference alone is as
/// large as the difference where all of it is one mirrored lamp in one pixel.
bool Fit::is_equivalent(const Validation& sharp, const Validation& blurred) {
  return sharp.unbiased <= blurred.unbiased + std::sqrt(blurred.variance) &&
         !is_worse(sharp, blurred, 1);
}

bool Fit::searches_ior() const {
  bool image = false;
  for (std::size_t f = 0; f < fields_.refs().size(); ++f) image = image || fields_.image(f);
  return searched_ && image;
}

std::vector<int> Fit::sharp_refractions(const Vector& x) const {
  std::vector<int> found;
  if (!searches_ior()) return found;
  const Scene scene = unknowns_.scene_with(scene_, x);
  for (int k = 0; k < unknowns_.size(); ++k) {
    const Component& one = unknowns_.components()[static_cast<std::size_t>(k)];
    const ParameterRef& ref = unknowns_.parameters()[static_cast<std::size_t>(one.parameter)];
    if (is_sharp_refraction(scene, ref)) found.push_back(k);
  }
  return found;
}

/// Lamps that are seen through a body are at other pixels with another IOR: few iterations of
/// derivatives tell little of it, but the loss falls off on both sides, whatever the texels are.
Vector Fit::ior_line_search(Vector x, Progress* progress) {
  const Reparametrization reparametrization(unknowns_);
  for (const int k : sharp_refractions(x)) {
    Vector u = reparametrization.from_values(x);
    const auto loss = [&](double at) {
      u[k] = at;
      const Vector there = unknowns_.project(reparametrization.to_values(u));
      return validate(there, field_values_, settings_.spp, progress).unbiased;
    };
    u[k] = parabolic_line_search(loss, u[k],
                         {kRefractionStep, reparametrization.minimum()[k], reparametrization.maximum()[k]});
    x[k] = unknowns_.project(reparametrization.to_values(u))[k];
  }
  return x;
}

/// Before a turn of the scalars and after the last one: what of them is not left to derivatives.
///
/// From a blurred body the way back is long, as texels and voxels paint the details that it lacks: a
/// sharp one is tried beside it; before the first turn only if it has an IOR of its own, as while
/// texels or voxels are nearly alike hardly anything else tells the one from the other.
bool Fit::begin_trials() {
  const bool first = count_iterations(&Block::scalars, result_.iterations) == 0;
  const bool sharp = is_low_roughness(x_);
  if (!searched_ || tried_ || (first && !searches_ior())) return false;
  if (sharp && sharp_refractions(x_).empty()) return false;
  trials_.push_back({x_, {}});
  if (!sharp) trials_.push_back({at_low_roughness(x_), {}});
  return true;
}

/// The next of them; after the last one the better is taken.
bool Fit::compare_trials(Progress* progress) {
  Trial& next =
      *std::ranges::find_if(trials_, [](const Trial& one) { return one.validation.parts.empty(); });
  const Vector x = ior_line_search(next.x, progress);
  next = {x, validate(x, field_values_, progress)};
  if (too_many_dropped()) return false;
  if (trials_.back().validation.parts.empty()) return true;
  const bool sharp =
      trials_.size() > 1 && is_equivalent(trials_.back().validation, trials_.front().validation);
  if (sharp && !field_gauss_newton_) optimiser_->reset_everything();
  Trial& best = sharp ? trials_.back() : trials_.front();
  x_ = result_.last = best.x;
  tried_ = std::move(best.validation);
  trials_.clear();
  return is_over() ? finish(progress) : true;
}

}  // namespace selenite
