// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <vector>

#include "fit/evaluate/finite_differences.h"
#include "fit/inference/weak_directions.h"
#include "fit/problem/saved_state.h"
#include "fit/problem/significance.h"
#include "fit/problem/unknowns.h"

namespace selenite {

/// Standard deviations of a normal distribution that hold 90 % of it: its quantile at 0.95.
inline constexpr double kQuantile90 = 1.6449;

/// Sources: docs/measurements/constants.md, "ConfidenceOptions". Ranges are those in
/// `Reparametrization`.
struct ConfidenceOptions {
  double undetermined = kNarrowShare;  ///< standard deviation, of the range, that says nothing
  double prior = 0.29;                 ///< of an even spread over the range: 1 / sqrt(12)
  double resolved = kCertainSigmas;    ///< own standard deviations from which a direction counts
  double coupled = kLikelySigmas;  ///< the same for entries of the normal matrix off the diagonal
  double correlated = 0.8;         ///< correlation that is reported
  double decades = 4.6;  ///< largest range of a logarithm: log 100, a factor of ten either way
  /// Of 1/4 log(x^4 + shift^4): down to 0 pictures change with the fourth power of a roughness x (3.6,
  /// measured from 0.01 to 0.07 and 0.23).
  double roughness_shift = 0.2;
  /// Length of the finite differences that the slope by a roughness is measured with.
  double roughness_difference = FiniteDifferenceOptions{}.roughness;
  double no_direction = 0.1;  ///< of that length, below which the direction of a step is noise
  /// Points, and standard deviations either way, of the mean roughness by likelihood.
  int likelihood_points = 200;
  double likelihood_reach = 4;
  /// Share of a diagonal entry of the normal matrix that remains where only the square of a value shows.
  double square_share = 0.1;
};
inline constexpr ConfidenceOptions kConfidence;

enum class AtBound { kNo, kMinimum, kMaximum };

/// What the photos say about one scalar.
struct Confidence {
  double standard_error = 0;         ///< infinite where nothing is known
  double by_slope = 0;               ///< the same by the slope at the values of the pass alone
  std::array<double, 2> interval{};  ///< holds the truth in 90 % of all fits; inside the bounds
  bool determined = false;           ///< else neither of the two is to be shown
  double lasting = 0;  ///< share of its variance that is no noise: photos differ by it
  AtBound at_bound = AtBound::kNo;
  int correlated_with = -1;  ///< component that can make up for it in these photos
};

/// Whether something remains that no value of the unknowns explains.
struct Misfit {
  double value =
      0;  ///< mean square of render minus photo by the weights of the fit, in units of the
          ///< photo's brightness, as far as neighbouring pixels share it: noise of the photo
          ///< does not count
  double standard_error = 0;
  bool explained = true;
};

struct TrustReport {
  std::vector<Confidence> components;  ///< empty: no refinement, or parameters of a medium
  Misfit misfit;
  int passes = 0;
  int spp = 0;  ///< samples a pixel of the last pass
  /// Values far from the answer that explain the photos as well; see `AlternativeMinima`.
  std::vector<Vector> alternatives;
  std::vector<int> ambiguous;  ///< components that were determined but for them
  /// Of all components, in `Reparametrization`; of what shows in nothing or is at a bound by how far it
  /// may go.
  Eigen::MatrixXd covariance{};
  std::vector<Eigen::MatrixXd> gain_slopes{};  ///< see `GainSlopes`
  std::vector<WeakDirection> weak{};           ///< what makes up for what
  void members(SavedState& state) {
    state(components, misfit, passes, spp, alternatives, ambiguous, covariance, gain_slopes, weak);
  }
};

}  // namespace selenite
