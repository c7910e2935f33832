// SPDX-License-Identifier: GPL-3.0-or-later
// How a fit goes about scalars and fields in turns.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "fit/fit.h"
#include "fit/streams.h"

namespace selenite {
namespace {

/// Iterations of scalars and of fields where they take turns; fewer in a short fit.
constexpr int kScalarTurn = 5, kFieldTurn = 5;
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
constexpr int kTrialSteps = 1;  ///< of the fields

}  // namespace

/// Without a search the scalars are first: a field starts best at the one value that suits the whole
/// object. After one they are as good as they get while the voxels are alike: the fields are first, and
/// the scalars have the last turn, as they are fitted to the voxels that are found. Where both are
/// stepped together, scalars that are still wrong lead voxels astray: theirs is the first whole turn.
bool Fit::is_turn_of_scalars(int iteration) const {
  const std::int64_t all = all_iterations();
  if (!searched_) {
    const std::int64_t scalars = std::clamp<std::int64_t>(all / 2, 1, kScalarTurn);
    return iteration % (scalars + std::clamp<std::int64_t>(all - scalars, 1, kFieldTurn)) < scalars;
  }
  if (field_newton_) {
    const std::int64_t first = std::min<std::int64_t>(kFirstFields, all / 5);
    const std::int64_t turn = (kCycle * kScalarTenths + 5) / 10;
    return iteration >= all - turn || (iteration >= first && (iteration - first) % kCycle < turn);
  }
  const std::int64_t cycles = std::max<std::int64_t>(1, (all + kCycle / 2) / kCycle);
  const std::int64_t cycle = ((iteration + 1) * cycles - 1) / all;
  const std::int64_t begin = cycle * all / cycles, end = (cycle + 1) * all / cycles;
  return iteration >= end - std::max<std::int64_t>(1, (kScalarTenths * (end - begin) + 5) / 10);
}

Fit::Turn Fit::turn(int iteration) const {
  if (!in_turns_) return {true, !fields_.empty(), false};
  const bool scalars = is_turn_of_scalars(iteration);
  return {scalars, !scalars, iteration == 0 || is_turn_of_scalars(iteration - 1) != scalars};
}

int Fit::all_iterations() const {
  const bool looks = field_newton_ && wants_verification();
  return looks ? (settings_.iterations + 1) / 2 : settings_.iterations;
}

int Fit::turns_of(bool Turn::*member, int iterations) const {
  int count = 0;
  for (int i = 0; i < iterations; ++i) count += turn(i).*member;
  return count;
}

/// After a search fields are still alike, have a long way to go and few steps: these begin long and, of
/// images, wide. Those of images end short and narrow, as the noise of texels looks like detail, and a
/// body that is blurred a little then explains the photos better than the right one. Voxels have
/// farther to go.
std::vector<FieldStep> Fit::field_steps() const {
  std::vector<FieldStep> steps(fields_.refs().size());
  if (!searched_) return steps;
  const double done = static_cast<double>(turns_of(&Turn::fields, result_.iterations)) /
                      turns_of(&Turn::fields, settings_.iterations);
  const auto between = [done](double first, double last) { return first + (last - first) * done; };
  double pixels = 0;
  for (const Capture& photo : captures_)
    pixels +=
        static_cast<double>(std::ranges::count_if(photo.weight, [](float w) { return w > 0; }));
  const auto side = [&](double share) { return std::sqrt(std::min(share / pixels, kMostSpread)); };
  const double spread = std::pow(between(side(kFirstSpread), side(kLastSpread)), 2);
  // Each photo makes a step.
  const double share = 1 / std::sqrt(static_cast<double>(captures_.size()));
  for (std::size_t f = 0; f < steps.size(); ++f)
    steps[f] = {share * between(kFirstRate, fields_.image(f) ? kLastRate : 1), spread};
  return steps;
}

FieldGradient Fit::field_gradient(const Vector& x, const FieldValues& fields, int capture,
                                  std::uint64_t seed, Progress* progress) {
  const Capture& photo = captures_[static_cast<std::size_t>(capture)];
  const Scene scene = scene_at(x, fields);
  FieldGradient found =
      loss_field_gradient(scene, scene.camera(photo.camera), fields_, photo, loss_,
                          render_settings(photo, settings_.spp, seed), progress);
  count(found.film, photo);
  return found;
}

/// What noise is left in the steps of texels. Voxels have farther to go and stay as they are.
void Fit::smooth(const Turn& now) {
  if (now.first) field_means_ = field_values_;
  const bool ends = turn(result_.iterations + 1).scalars;
  for (std::size_t f = 0; f < field_values_.size(); ++f) {
    if (!fields_.image(f)) continue;
    field_means_[f] += kNewest * (field_values_[f] - field_means_[f]);
    if (ends) field_values_[f] = field_means_[f];
  }
}

Vector Fit::sharpened(Vector x) const {
  for (int k = 0; k < unknowns_.size(); ++k)
    if (unknowns_.description_of(k).coordinate == Coordinate::kBlur)
      x[k] = std::min(x[k], kSharpRoughness);
  return unknowns_.project(x);
}

/// Within its standard error, and that of their difference: what is wrong about texels and voxels looks
/// like blur, so that of two bodies that are about as good the sharp one is nearer. The noise of a
/// validation alone hides a gloss that pixel against pixel is seen; that of the difference alone is as
/// large as the difference where all of it is one mirrored lamp in one pixel.
bool Fit::is_as_good(const Validation& sharp, const Validation& blurred) {
  return sharp.unbiased <= blurred.unbiased + std::sqrt(blurred.variance) &&
         !is_worse(sharp, blurred, 1);
}

/// Before a turn of the scalars; but not the first, when fields are nearly alike and hardly anything
/// tells a blurred body from a sharp one. From a blurred one the way back is long, as texels and voxels
/// paint the details that it lacks.
bool Fit::begin_trials() {
  if (!searched_ || tried_ || turns_of(&Turn::scalars, result_.iterations) == 0) return false;
  const Vector sharp = sharpened(x_);
  if (sharp == x_) return false;
  for (const Vector& one : {x_, sharp})
    trials_.push_back({one, field_values_, field_adam_, 0, Validation()});
  return true;
}

/// One step from one of them.
bool Fit::try_fields(Progress* progress) {
  const int steps = field_newton_ ? 0 : kTrialSteps;
  const auto unfinished = [](const Trial& one) { return one.validation.parts.empty(); };
  Trial next = *std::ranges::find_if(trials_, unfinished);
  const std::vector<FieldStep> how = field_steps();
  for (int i = 0; i < static_cast<int>(captures_.size()) && next.steps < steps; ++i) {
    const std::uint64_t seed =
        stream_seed(settings_.seed, Stream::kTrial, result_.iterations + next.steps, i);
    next.adam.step(next.fields, field_gradient(next.x, next.fields, i, seed, progress).fields, how);
  }
  if (next.steps < steps) ++next.steps;
  if (next.steps == steps) next.validation = validate(next.x, next.fields, progress);
  *std::ranges::find_if(trials_, unfinished) = std::move(next);
  if (too_many_dropped()) return false;
  if (std::ranges::any_of(trials_, unfinished)) return true;
  const bool sharp = is_as_good(trials_[1].validation, trials_[0].validation);
  if (sharp && !field_newton_) optimiser_->start_anew();
  Trial& best = trials_[sharp ? 1 : 0];
  x_ = result_.last = best.x;
  field_values_ = std::move(best.fields);
  result_.fields_last = std::make_shared<FieldValues>(field_values_);
  field_adam_ = std::move(best.adam);
  tried_ = std::move(best.validation);
  trials_.clear();
  return true;
}

}  // namespace selenite
