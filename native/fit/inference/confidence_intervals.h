// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "fit/inference/normal_equations.h"
#include "fit/problem/saved_state.h"

namespace selenite {

/// Sources: docs/measurements/constants.md, "ConfidenceOptions".
struct ConfidenceOptions {
  double quantile_90 = 1.6449;  ///< standard deviations that hold 90 % of a normal distribution
  /// Share of its range, in `Reparametrization`, beyond which a standard deviation says nothing that
  /// the bounds have not said.
  double undetermined = 0.1;
  double prior = 0.29;     ///< standard deviation of an even spread over the range, as its share
  double resolved = 3;     ///< own standard deviations from which a direction counts
  double coupled = 2;      ///< the same for entries of the normal matrix beside the diagonal
  double correlated = 0.8; ///< correlation that is reported
  double decades = 4.6;    ///< largest range in logarithms: a factor of ten either way
};
inline constexpr ConfidenceOptions kConfidence;

enum class AtBound { kNo, kMinimum, kMaximum };

/// What the photos say about one scalar.
struct Confidence {
  double standard_error = 0;         ///< infinite where nothing is known
  double by_slope = 0;               ///< the same by the slope at the values looked at alone
  std::array<double, 2> interval{};  ///< holds the truth in 90 % of all fits; inside the bounds
  bool determined = false;           ///< else neither of the two is to be shown
  AtBound at_bound = AtBound::kNo;
  int correlated_with = -1;  ///< component that can make up for it in these photos
};

/// Whether something is left that no value of the unknowns explains.
struct Misfit {
  double value = 0;  ///< mean square of render minus photo, in units of the photo's brightness, as
                     ///< far as neighbouring pixels share it: noise of the photo does not count
  double standard_error = 0;
  bool explained = true;
};

struct TrustReport {
  std::vector<Confidence> components;  ///< empty: not verified, or parameters of a medium
  Misfit misfit;
  int passes = 0;
  /// Values far from the answer that explain the photos as well; see `AlternativeMinima`.
  std::vector<Vector> alternatives;
  std::vector<int> ambiguous;  ///< components that were determined but for them
  void members(SavedState& state) { state(components, misfit, passes, alternatives, ambiguous); }
};

/// One Gauss-Newton step from the equations, and how sure it is.
struct Estimate {
  Vector step;          ///< in determined directions only, inside the bounds
  double surprise = 0;  ///< largest component of it along a direction, in standard deviations
  std::vector<Confidence> components;
};
/// What another look has found of a component.
struct Known {
  double value;
  Confidence confidence;
};
/// What other looks say, in `Reparametrization`; empty: nothing.
struct OtherPasses {
  Vector previous_step{};  ///< way from the one before to this: a roughness that turns back stays within it
  Vector unsure_step{};                            ///< way that counts as one standard error more
  std::vector<std::optional<Known>> known{};  ///< see beside.h
  std::vector<bool> squared{};  ///< components of which nothing goes with the value itself
  double beyond_noise = 1;  ///< errors in units of those told by noise; steps do not depend on it
  void members(SavedState& state) {
    state(previous_step, unsure_step, known, squared, beyond_noise);
  }
};
Estimate estimate(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& u,
                  const NormalEquations& equations, const OtherPasses& others = {});

/// Widens the intervals to hold x, which is what the user gets: a step may lead beyond the end of the
/// longest that is taken, or of a bound, and then the interval of where it leads may not reach back.
void contain(const Unknowns& unknowns, const Reparametrization& reparametrization, const Vector& x,
          std::vector<Confidence>& components);

}  // namespace selenite
