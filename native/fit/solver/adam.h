// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/optimiser.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "AdamOptions".
struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.999;  ///< decay of the moments: Kingma and Ba 2015, algorithm 1
  /// Added to the root of the second moment: it keeps 0 / 0 at 0 for an unknown that no picture shows.
  /// It is far below any true gradient, as a loss has no natural scale: the usual 1e-8 would slow the
  /// fit of a dim scene.
  double tiny = 1e-30;
};

/// Running moments of a gradient, and the step that they give.
/// Source: Kingma and Ba 2015, algorithm 1.
class AdamMoments {
 public:
  explicit AdamMoments(Eigen::Index size, const AdamOptions& options = {})
      : options_(options), first_(Vector::Zero(size)), second_(first_) {}
  /// The next values, inside the bounds; `rate` is the length of a step of each unknown.
  Vector update(const Vector& x, const Vector& gradient, const Vector& rate, const Vector& minimum,
                const Vector& maximum);
  /// 1 for unknowns that have had a gradient, 0 for the others.
  Vector moving() const { return (second_.array() > 0).cast<double>(); }
  void members(SavedState& state);

 private:
  AdamOptions options_;
  Vector first_, second_;
  int steps_ = 0;
};

/// Adam with a learning rate per unknown and projection on the bounds.
class Adam final : public Optimiser {
 public:
  explicit Adam(const Problem& problem, const AdamOptions& options = {});
  Vector step(const Vector& x, std::span<const Observation> seen) override;
  std::unique_ptr<Optimiser> clone() const override { return std::make_unique<Adam>(*this); }
  void members(SavedState& state) override;

  /// One update with a known gradient.
  Vector update(const Vector& x, const Vector& gradient);

 private:
  const Problem* problem_;
  AdamMoments moments_;
};

}  // namespace selenite
