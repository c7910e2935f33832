// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/phases/starts/rotation_start.h"

#include <algorithm>
#include <cmath>

#include "fit/evaluate/seeds.h"
#include "fit/objective/half_buffers.h"
#include "fit/problem/pixel_weights.h"
#include "math/scalar.h"
#include "model/field_index.h"

namespace selenite {
namespace {

constexpr double kTurn = 2 * kPi<double>;

std::optional<int> component_of(const Problem& problem, int field) {
  return problem.unknowns.component_of(ParameterRef{OwnerKind::kWorld, 0, field});
}

}  // namespace

std::unique_ptr<RotationStart> RotationStart::of(const Problem& problem, std::uint64_t seed,
                                                 const RotationStartOptions& options) {
  const auto component =
      component_of(problem, field_index<WorldParameters>(&WorldParameters::rotation));
  if (!component) return nullptr;
  return std::unique_ptr<RotationStart>(new RotationStart(problem, *component, seed, options));
}

RotationStart::RotationStart(const Problem& problem, int component, std::uint64_t seed,
                             const RotationStartOptions& options)
    : options_(options), problem_(&problem), component_(component), seed_(seed) {
  for (const Photo& photo : problem.photos) {
    photos_.push_back(photo.resized(options_.size));
    weights_.push_back(relative_weights(photos_.back(), problem.photos.size()));
  }
  const double start = problem.unknowns.start()[component];
  for (int i = 0; i < options_.angles; ++i) {
    const double angle = start + kTurn * i / options_.angles;
    if (is_permitted(angle)) angles_.push_back(angle);
  }
}

Vector RotationStart::at(double angle) const {
  const Unknowns& unknowns = problem_->unknowns;
  const double low = unknowns.minimum()[component_], high = unknowns.maximum()[component_];
  Vector x = unknowns.start();
  double& found = x[component_] = std::remainder(angle, kTurn);
  if (found < low) found += kTurn * std::ceil((low - found) / kTurn);
  if (found > high) found -= kTurn * std::ceil((found - high) / kTurn);
  return x;
}

bool RotationStart::is_permitted(double angle) const {
  return at(angle)[component_] >= problem_->unknowns.minimum()[component_];
}

std::size_t RotationStart::best() const {
  return static_cast<std::size_t>(std::ranges::min_element(misfits_) - misfits_.begin());
}

bool RotationStart::step(Evaluator& evaluator) {
  const Vector x = at(angles_[misfits_.size()]);
  double both = 0, squares = 0, photos = 0;
  // Equal seeds for all angles: what their noise has in common decides nothing.
  const auto how = [&](std::size_t i) {
    return Evaluation{options_.spp, seed_of(seed_, 0, static_cast<int>(i))};
  };
  Ahead ahead;
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    ahead.reach(evaluator, i, photos_.size(),
                [&](std::size_t k) { evaluator.expect({x}, photos_[k], how(k)); });
    const Halves seen = residual_halves(evaluator.evaluate({x}, photos_[i], how(i)), photos_[i]);
    for (Eigen::Index k = 0; k < seen.residual_a.size(); ++k) {
      const auto pixel = static_cast<std::size_t>(k / 3);
      const double photo = photos_[i].reference[pixel][static_cast<int>(k % 3)];
      const double a = photo + static_cast<double>(seen.residual_a[k]);
      const double b = photo + static_cast<double>(seen.residual_b[k]);
      const auto weight = static_cast<double>(weights_[i][k]);
      both += weight * photo * (a + b) / 2;
      squares += weight * a * b;
      photos += weight * photo * photo;
    }
  }
  const double factor = squares > 0 ? both / squares : 1;
  factors_.push_back(factor);
  misfits_.push_back(photos - both * factor);
  if (misfits_.size() == angles_.size()) add_angles();
  return !over();
}

/// The neighbours of the best one, at half the distance.
void RotationStart::add_angles() {
  const double apart = kTurn / options_.angles / static_cast<double>(1 << ++halving_);
  if (over()) return;
  const double middle = angles_[best()];
  for (const double side : {-apart, apart})
    if (is_permitted(middle + side)) angles_.push_back(middle + side);
  if (misfits_.size() == angles_.size()) add_angles();
}

double RotationStart::fraction() const {
  return over() ? 1
                : static_cast<double>(misfits_.size()) /
                      static_cast<double>(options_.angles + 2 * options_.halvings);
}

Vector RotationStart::values() const {
  Vector x = at(angles_[best()]);
  if (const auto strength =
          component_of(*problem_, field_index<WorldParameters>(&WorldParameters::strength)))
    x[*strength] *= std::max(factors_[best()], 0.0);
  return problem_->unknowns.project(x);
}

}  // namespace selenite
