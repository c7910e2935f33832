// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "fit/evaluate/finite_differences.h"
#include "fit/objective/half_buffers.h"
#include "fit/problem/problem.h"
#include "render/driver/progress.h"

namespace selenite {

class SavedState;

/// Chooses the next values from renders of the current ones. It holds no randomness: equal
/// observations give equal steps. The problem must outlive it. A copy (`clone`) is its whole state.
class Optimiser {
 public:
  virtual ~Optimiser() = default;
  /// The next values, inside the bounds. `seen` holds one observation, or one per photo.
  /// Throws std::runtime_error naming the unknown when a derivative is not finite.
  virtual Vector step(const Vector& x, std::span<const Observation> seen) = 0;
  /// The best estimate when no more steps follow; `x` is what `step` returned last.
  virtual Vector estimate(const Vector& x) const { return x; }
  /// Forgets what residuals of the past say: something else in the scene has moved.
  virtual void reset_equations() {}
  /// Forgets the derivatives as well: the values are not those that the last step led to.
  virtual void reset_everything() {}
  /// Whether the rest of the way is short enough for refinement passes at fixed values, which take
  /// fewer samples for it than more steps do.
  virtual bool converged() const { return false; }
  virtual std::unique_ptr<Optimiser> clone() const = 0;
  /// All that changes from step to step.
  virtual void members(SavedState& state) = 0;
  /// A step can be cancelled through it until it is replaced; null: it cannot. No other step may
  /// follow a cancelled one, which has thrown Cancelled.
  void watch(const Progress* progress) { progress_ = progress; }

 protected:
  const Progress* progress() const { return progress_; }

 private:
  const Progress* progress_ = nullptr;
};

/// An optimiser that keeps the derivatives of earlier steps and can step without new ones. Scalars
/// follow fields so, while Adam moves these.
class ResidualOptimiser : public Optimiser {
 public:
  /// The next values, from one observation per photo without derivatives. Returns `x` before the
  /// first `step`.
  virtual Vector step_by_residuals(const Vector& x, std::span<const Observation> seen) = 0;
};

struct OptimiserKind {
  std::string_view name;
  std::string_view help;
  int least_spp;
  bool needs_all_photos;     ///< it cannot step after every photo
  bool least_squares_only;   ///< for losses that are sums of squares
  bool few_unknowns;         ///< for up to kFewUnknowns; it is a `ResidualOptimiser`
  bool averages_iterations;  ///< `estimate` draws on all iterations, and so has less noise than one
  Purpose purpose;
  std::unique_ptr<Optimiser> (*make)(const Problem& problem);
};

std::span<const OptimiserKind> optimisers();
/// By name. "auto" takes Gauss-Newton for up to kFewUnknowns where the loss and `spp` permit it,
/// else Adam. InvalidArgument lists the names, or says why the optimiser does not go with the
/// settings.
const OptimiserKind& choose_optimiser(std::string_view name, int unknowns, const Loss& loss,
                                      int spp, bool accumulate);

}  // namespace selenite
