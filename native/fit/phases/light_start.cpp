// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/light_start.h"

#include "fit/evaluate/seeds.h"
#include "fit/problem/pixel_weights.h"

namespace selenite {

std::unique_ptr<LightStart> LightStart::of(const FitProblem& problem, std::uint64_t seed) {
  if (!problem.fields().has_environment()) return nullptr;
  std::vector<Photo> small;
  for (const Photo& photo : problem.photos())
    small.push_back(photo.resized(LightStartOptions{}.size));
  std::unique_ptr<LightSteps> steps = LightSteps::of(problem.fields(), small);
  if (!steps) return nullptr;
  return std::unique_ptr<LightStart>(
      new LightStart(problem, std::move(small), std::move(steps), seed));
}

LightStart::LightStart(const FitProblem& problem, std::vector<Photo> photos,
                       std::unique_ptr<LightSteps> steps, std::uint64_t seed)
    : problem_(&problem),
      photos_(std::move(photos)),
      steps_(std::move(steps)),
      fields_(problem.fields().start()),
      seed_(seed) {
  for (const Photo& photo : photos_) weights_.push_back(relative_weights(photo, photos_.size()));
  steps_->begin(fields_);
}

bool LightStart::step(PhotoEvaluator& evaluator) {
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    const int index = static_cast<int>(i);
    (void)steps_->observe(evaluator, {problem_->start().scalars, fields_}, photos_[i], i,
                          {options_.spp, seed_of(seed_, done_, index)}, weights_[i], options_.kept);
  }
  steps_->step(fraction(), fields_);
  return ++done_ < options_.passes;
}

}  // namespace selenite
