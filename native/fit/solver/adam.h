// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/optimiser.h"

namespace selenite {

/// Running moments of a gradient, and the step that they give.
/// Source: Kingma and Ba 2015, algorithm 1.
class AdamMoments {
 public:
  explicit AdamMoments(Eigen::Index size) : first_(Vector::Zero(size)), second_(first_) {}
  /// The next values, inside the bounds; `rate` is the length of a step of each unknown.
  Vector update(const Vector& x, const Vector& gradient, const Vector& rate, const Vector& minimum,
                const Vector& maximum);
  void members(SavedState& state);

 private:
  Vector first_, second_;
  int steps_ = 0;
};

/// Adam with a learning rate per unknown and projection on the bounds.
class Adam final : public Optimiser {
 public:
  explicit Adam(const Problem& problem);
  Vector step(const Vector& x, std::span<const Observation> seen,
              FieldGaussNewton* fields = nullptr) override;
  std::unique_ptr<Optimiser> clone() const override { return std::make_unique<Adam>(*this); }
  void members(SavedState& state) override;

  /// One update with a known gradient.
  Vector update(const Vector& x, const Vector& gradient);

 private:
  const Problem* problem_;
  AdamMoments moments_;
};

}  // namespace selenite
