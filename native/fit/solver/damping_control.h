// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "fit/objective/photo_weights.h"
#include "fit/problem/significance.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "GaussNewtonOptions".
struct DampingOptions {
  double first = 0.1;                   ///< in units of the scaled normal matrix
  double early = 0.05, late = 0.002;    ///< least damping before and after `late_from`
  double late_from = 0.64;              ///< share of the iterations
  double decrease = 1.0 / 3;            ///< factor after an accepted step
  double increase = 5;                  ///< factor after a rejected one
  double large_step = 0.25;             ///< longest steps: a shorter step is never rejected
  int most_rejections = 3;              ///< in a row
  double worse_by = 0.1;                ///< loss above the best, relative, that rejects a step
  double worse_sigmas = kLikelySigmas;  ///< and in standard deviations beside that
  /// Longest steps: one of that size keeps 1/e of the past.
  double forget_at = 0.5;
  double least_kept = 0.1;  ///< share of the equations that every step keeps
};

/// Levenberg-Marquardt damping: it falls after accepted steps and rises after rejected ones. A step is
/// rejected if it was long and has made the loss worse by more than noise.
class DampingControl {
 public:
  explicit DampingControl(const DampingOptions& options = {})
      : options_(options), damping_(options.first) {}

  double damping() const { return damping_; }
  /// Least damping where this share of the iterations is over.
  double least(double done) const {
    return done < options_.late_from ? options_.early : options_.late;
  }
  /// Rejects the last step if its `loss` is too far above the best one.
  bool rejects(const NoisyLoss& loss);
  /// Accepts the last step.
  void accept(double least);
  void raise_to(double least);
  /// Share of the past that is kept after the last step: equations hold where they were made.
  double kept() const;
  /// Notes the length of a step, its largest component in longest steps.
  void note_step(double length) { last_step_ = length; }
  /// Notes the loss at `u`, which may be the best.
  void note_loss(const NoisyLoss& loss, const Vector& u);
  /// Losses from now on do not compare with those before.
  void forget_best() { best_.reset(); }
  /// The values to return to after a rejection.
  const Vector& best() const { return best_->u; }
  void reset();
  void members(SavedState& state);

 private:
  struct Best {
    NoisyLoss loss;
    Vector u;
    void members(SavedState& state);
  };

  DampingOptions options_;
  double damping_;
  double last_step_ = 0;
  int rejected_ = 0;  ///< in a row
  std::optional<Best> best_;
};

}  // namespace selenite
