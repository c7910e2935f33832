// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "fit/evaluate/finite_differences.h"
#include "fit/evaluate/half_buffers.h"
#include "fit/problem/problem.h"

namespace selenite {

class FieldGaussNewton;
class SavedState;

/// Chooses the next values from renders of the current ones. Holds no randomness: equal
/// observations give equal steps. The problem must outlive it. A copy (`clone`) is its whole state.
class Optimiser {
 public:
  virtual ~Optimiser() = default;
  /// The next values, inside the bounds. `seen` holds one observation, or one per photo.
  /// Throws std::runtime_error naming the unknown when a derivative is not finite.
  virtual Vector step(const Vector& x, std::span<const Observation> seen,
                      FieldGaussNewton* fields = nullptr) = 0;
  /// The next values where something else in the scene moves meanwhile: `seen` has no derivatives, one
  /// observation per photo. Stays where nothing can be told without.
  virtual Vector step_by_residuals(const Vector& x, std::span<const Observation> /*seen*/,
                        FieldGaussNewton* /*fields*/ = nullptr) {
    return x;
  }
  /// The best estimate when no more steps follow; `x` is what `step` returned last.
  virtual Vector estimate(const Vector& x) const { return x; }
  /// Something else in the scene has moved: what earlier residuals told is no longer true.
  virtual void reset_equations() {}
  /// The values are others than those that the last step led to: nothing that was seen holds there.
  virtual void reset_everything() {}
  /// Whether the last step left so little that a look at frozen values (`Refinement`) can go the
  /// rest better than more steps.
  virtual bool converged() const { return false; }
  virtual std::unique_ptr<Optimiser> clone() const = 0;
  /// All that changes from step to step.
  virtual void members(SavedState& state) = 0;
};

struct OptimiserKind {
  std::string_view name;
  std::string_view help;
  int least_spp;
  bool needs_all_photos;  ///< cannot step after every camera
  bool least_squares_only;  ///< for losses that are sums of squares
  bool few_unknowns;        ///< made for up to kFewUnknowns
  bool averages_iterations;  ///< `estimate` draws on all of them, and so beats any single one up to noise
  Purpose purpose;
  std::unique_ptr<Optimiser> (*make)(const Problem& problem);
};

std::span<const OptimiserKind> optimisers();
/// By name; "auto" takes Gauss-Newton for up to 12 unknowns where the loss and `spp` permit it,
/// else Adam. InvalidArgument lists the names, or says why the optimiser does not go with the
/// settings.
const OptimiserKind& choose_optimiser(std::string_view name, int unknowns, const Loss& loss,
                                      int spp, bool accumulate);

}  // namespace selenite
